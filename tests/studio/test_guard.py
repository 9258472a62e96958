"""Who may talk to the studio: the token, Host and Origin, and nothing of the file system behind it."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import json
import socket
import stat
import time
from pathlib import Path

import pytest

from splinefeed.errors import InputError
from splinefeed.studio.sources import LARGEST, MOST, put, upload
from studio.conftest import Studio
from studio_tools import new_tab


def ask(studio, path: str, method: str = "GET", body: bytes | None = None, **headers: str):
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=200)
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, body, given)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer, content


@pytest.fixture(scope="module")
def cookie(studio):
    answer, _ = ask(studio, f"/?token={studio.token}")
    said = answer.headers["Set-Cookie"]
    assert "HttpOnly" in said
    assert "SameSite=Strict" in said
    return said.partition(";")[0]


def test_nothing_without_the_token(studio):
    for path in ("/", "/?token=", f"/?token={studio.token[:-1]}", "/page/main.js", "/download/" + "0" * 32):
        answer, content = ask(studio, path)
        assert answer.status == 403, path
        assert b"token" in content
    answer, _ = ask(studio, f"/page/main.js?token={studio.token}")
    assert answer.status == 403  # it opens the page alone


def test_every_answer_forbids_what_is_not_ours(studio, cookie):
    for path in ("/", "/page/main.js", "/page/nothing.js"):
        answer, _ = ask(studio, path, Cookie=cookie)
        policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'none'; script-src 'self';" in policy
        assert "unsafe-eval" not in policy
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Referrer-Policy"] == "no-referrer"


def test_a_name_that_points_here_is_not_enough(studio, cookie):
    for host in ("evil.example", f"evil.example:{studio.port}", "127.0.0.1", f"[::1]:{studio.port}"):
        assert ask(studio, f"/?token={studio.token}", Host=host)[0].status == 421, host
        assert ask(studio, "/", Host=host, Cookie=cookie)[0].status == 421, host
    assert ask(studio, "/", Host=f"localhost:{studio.port}", Cookie=cookie)[0].status == 200


def test_other_sites_can_neither_post_nor_listen(studio, cookie):
    socket = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13", "Sec_WebSocket_Key": "x"}
    for origin in ("http://evil.example", "null", f"http://localhost:{studio.port}", "http://127.0.0.1"):
        assert ask(studio, "/upload", "POST", b"x", Cookie=cookie, Origin=origin)[0].status == 403, origin
        assert ask(studio, "/socket", Cookie=cookie, Origin=origin, **socket)[0].status == 403, origin
    assert ask(studio, "/upload", "POST", b"x", Cookie=cookie)[0].status == 403
    assert ask(studio, "/socket", Cookie=cookie, **socket)[0].status == 403


@pytest.mark.parametrize(
    "path",
    [
        "/page/../server.py",
        "/page/%2e%2e/server.py",
        "/page/..%2fserver.py",
        "//etc/passwd",
        "/download/../../etc/passwd",
        "/download/" + "a" * 32,
        "/etc/passwd",
    ],
)
def test_no_path_leads_to_the_file_system(studio, cookie, path):
    answer, content = ask(studio, path, Cookie=cookie)
    assert answer.status in (400, 404)
    assert b"root:" not in content
    assert b"import" not in content


def test_uploads_are_bounded_in_size_and_number(studio, cookie, tmp_path):
    own = {"Cookie": cookie, "Origin": f"http://127.0.0.1:{studio.port}"}
    answer, content = ask(studio, "/upload", "POST", b"0", **own, X_Name="..%2F..%2Fetc%2Fpasswd")
    assert answer.status == 200
    kept = list((studio.temporary).glob(f"*/uploads/{json.loads(content)['file']}/*"))
    assert [each.name for each in kept] == ["passwd"]
    answer, content = ask(studio, "/upload", "POST", b"", **own)
    assert answer.status == 413 and "the file has 0 bytes" in json.loads(content)["error"]
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=200)
    connection.putrequest("POST", "/upload")
    for name, value in {**own, "Content-Length": str(LARGEST + 2)}.items():
        connection.putheader(name, value)
    connection.endheaders()
    assert connection.getresponse().status in (400, 413)
    connection.close()
    names = [put(tmp_path, f"{k}.dxf", b"x") for k in range(20)]
    assert len(list(tmp_path.iterdir())) <= MOST
    assert (upload(names[-1], tmp_path).name, upload(names[-1], tmp_path).read_bytes()) == ("19.dxf", b"x")
    with pytest.raises(InputError, match="is gone"):
        upload(names[0], tmp_path)


def test_connections_that_say_nothing_do_not_lock_the_owner_out(studio, cookie):
    with contextlib.ExitStack() as stack:
        silent = []
        for _ in range(300):
            silent.append(stack.enter_context(socket.create_connection(("127.0.0.1", studio.port), 10.0)))
        assert ask(studio, "/", Cookie=cookie)[0].status == 200
        gone = 0
        for each in silent[:200]:
            each.settimeout(10.0)
            with contextlib.suppress(OSError):
                gone += each.recv(1) == b""
        assert gone == 200


def test_silent_connections_do_not_lock_the_owner_out_where_few_files_may_be_open(tmp_path):
    few = Studio(tmp_path, most_files=64)
    try:
        with contextlib.ExitStack() as stack:
            for _ in range(200):
                stack.enter_context(socket.create_connection(("127.0.0.1", few.port), 10.0))
            answer, _ = ask(few, f"/?token={few.token}")
            assert answer.status == 200
            own = answer.headers["Set-Cookie"].partition(";")[0]
            said = asyncio.run(_spoken(few, own, json.dumps({"do": "share", "text": "period = '2 ms'"})))
            assert said[0]["settings"]["period"] == "2 ms"  # a worker is there, too
    finally:
        assert few.end() == 0


async def _spoken(studio, cookie: str, *messages: str) -> list[dict]:
    """What the socket of a new tab answers to messages."""
    found = []
    async with new_tab(studio.port, cookie) as connection:
        for message in messages:
            await connection.write_message(message)
            while True:
                said = await asyncio.wait_for(connection.read_message(), 200.0)
                assert said is not None, f"{message[:60]} closed the socket"
                said = json.loads(said)
                if said["kind"] in ("refused", "opened", "toml"):
                    found.append(said)
                    break
    return found


NUMBERS = ["1e999", "-1e999", "NaN", "Infinity", "9" * 30, "9" * 5000, "1e101"]


def test_numbers_that_are_none_are_refused_and_the_socket_stays_open(studio, cookie):
    forms = ('{"do": "plan", "n": %s, "settings": {}}', '{"do": "cancel", "job": %s}',
             '{"do": "history", "delete": %s}', '{"do": "play", "settings": {}, "top": %s, "override": 1}')  # fmt: skip
    said = asyncio.run(_spoken(studio, cookie, *(form % number for form in forms for number in NUMBERS), "[" * 9000))
    assert len(said) == len(forms) * len(NUMBERS) + 1
    assert all(each["kind"] == "refused" and each["error"]["fields"] for each in said)


def test_a_text_of_settings_is_parsed_by_a_worker_and_refused_in_its_words(studio, cookie):
    deep, good = f"limits.{'a.' * 20_000}b = 1", "period = '2 ms'"
    begin = time.monotonic()
    refused, opened = asyncio.run(
        _spoken(studio, cookie, *(json.dumps({"do": "share", "text": text}) for text in (deep, good)))
    )
    assert "more than 8 words between dots" in json.dumps(refused["error"])
    assert opened["settings"]["period"] == "2 ms"
    assert time.monotonic() - begin < 150.0


@pytest.mark.parametrize(
    "name", ["ü" * 255 + ".dxf", "\U0001f600" * 300, "a" * 255, "." * 255, "\0" * 40, "é" * 79 + "."]
)
def test_a_name_of_an_upload_may_be_anything(tmp_path, name):
    kept = upload(put(tmp_path, name, b"x"), tmp_path)
    assert kept.read_bytes() == b"x" and len(kept.name.encode()) <= 200


def test_the_browser_is_led_by_a_file_that_only_its_user_can_read(tmp_path):
    from splinefeed.studio.server import redirect

    address = redirect(tmp_path, "http://127.0.0.1:1/?token=abc&x=<")
    file = Path(address.removeprefix("file://"))
    assert "abc" not in address and stat.S_IMODE(file.stat().st_mode) == 0o600
    assert 'url=http://127.0.0.1:1/?token=abc&amp;x=&lt;"' in file.read_text()
