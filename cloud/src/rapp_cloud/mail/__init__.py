"""The embedded mail server: SMTP in (RFC 5321, STARTTLS, AUTH), a Maildir out.

The paper's "Gmail server" as cloud agent of the voice-mail RApp (paper §IV); a real account takes its place by option.
"""
