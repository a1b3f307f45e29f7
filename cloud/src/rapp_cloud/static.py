"""The store's files over HTTP: `/tuf/metadata/<file>` and `/tuf/targets/<file>`, nothing above or below."""

from tornado.web import StaticFileHandler, stream_request_body

from rapp_hop.server import JsonErrors

FILE_PATTERN = r"([0-9A-Za-z][0-9A-Za-z._-]{0,200})"  # no separator, no dot first


@stream_request_body
class StoreFiles(StaticFileHandler, JsonErrors):
    """A folder's files, to be read only; who verifies asks for the newest, so nothing is cached."""

    def data_received(self, chunk: bytes) -> None:
        """Throw away a body that nobody asked for."""

    def compute_etag(self) -> None:
        """Read no file twice for a tag."""

    def should_return_304(self) -> bool:
        """Send the file always."""
        return False
