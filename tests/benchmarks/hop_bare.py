"""What `bench hop` compares with: the same echo as a bare Tornado handler."""

import asyncio
import json
import signal
from typing import cast

import uvloop
from tornado.web import Application, RequestHandler


class Echo(RequestHandler):
    def post(self) -> None:
        self.set_header("Content-Type", "application/json")
        self.finish(json.dumps(json.loads(self.request.body)["value"]))


async def main() -> None:
    stop = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, stop.set)
    server = Application([("/hop/echo", Echo)], log_function=lambda _: None).listen(0, "127.0.0.1")
    port = next(iter(server._sockets.values())).getsockname()[1]
    print("READY " + json.dumps({"port": cast(int, port)}), flush=True)
    await stop.wait()


if __name__ == "__main__":
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(main())
