"""The embedded mail server: SMTP in, a Maildir out; each Message-ID is delivered once (paper Fig. 12, the "Gmail server")."""
