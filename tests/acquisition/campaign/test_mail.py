"""E-mail about a campaign, through a mail server in a thread of this process."""

import socketserver
import threading

import pytest

from vibench.acquisition import ConfigurationError, load_toml
from vibench.acquisition.campaign import MailMessenger, MailSettings

NOTICE = {"campaign": "c", "event": "ended", "reason": "c is finished", "recorded": 3}


class Conversation(socketserver.StreamRequestHandler):
    """The part of SMTP that a client without login uses."""

    def handle(self):
        self.reply("220 here")
        while line := self.rfile.readline().decode().strip():
            self.server.heard.append(line)
            match line.split(" ")[0].upper():
                case "EHLO":
                    self.reply("250 here")
                case "DATA":
                    self.reply("354 go on")
                    while (text := self.rfile.readline().decode().rstrip("\r\n")) != ".":
                        self.server.heard.append(text)
                    self.reply("250 kept")
                case "QUIT":
                    self.reply("221 bye")
                    return
                case _:
                    self.reply("250 yes")

    def reply(self, line):
        self.wfile.write(f"{line}\r\n".encode())


@pytest.fixture
def server():
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Conversation) as serving:
        serving.heard = []
        thread = threading.Thread(target=serving.serve_forever)
        thread.start()
        yield serving
        serving.shutdown()
        thread.join()


def settings(tmp_path, port, security="none"):
    path = tmp_path / "mail.toml"
    path.write_text(
        f'host = "127.0.0.1"\nport = {port}\nsecurity = "{security}"\n'
        'sender = "rig@lab.example"\nrecipients = ["me@lab.example"]\ntimeout_s = 5\n'
    )
    return load_toml(path, MailSettings)


def test_control_characters_do_not_break_a_mail(server, tmp_path):
    hostile = NOTICE | {"campaign": "c\nBcc: all@lab.example", "folder": "\udcff", "reason": "\x1b[2J\r\n."}
    said = MailMessenger(settings(tmp_path, server.server_address[1])).send(hostile)
    assert said == "mail sent to me@lab.example"
    assert r"reason: \x1b[2J\r\n." in server.heard
    assert r"folder: \udcff" in server.heard


def test_a_notice_is_sent_as_one_mail(server, tmp_path):
    said = MailMessenger(settings(tmp_path, server.server_address[1])).send(NOTICE)
    assert said == "mail sent to me@lab.example"
    assert "Subject: vibench: c: ended" in server.heard
    assert "reason: c is finished" in server.heard
    assert "recorded: 3" in server.heard


def test_a_missing_mail_server_is_reported_and_raises_no_exception(server, tmp_path):
    with socketserver.TCPServer(("127.0.0.1", 0), None) as closed:
        port = closed.server_address[1]
    assert MailMessenger(settings(tmp_path, port)).send(NOTICE).startswith("mail through 127.0.0.1 failed")


def test_a_mail_server_without_the_requested_encryption_is_not_used(server, tmp_path):
    said = MailMessenger(settings(tmp_path, server.server_address[1], "starttls")).send(NOTICE)
    assert said.startswith("mail through 127.0.0.1 failed")
    assert not any(line.startswith("Subject") for line in server.heard)


def test_the_mail_password_is_not_shown_and_an_invalid_sender_is_refused(tmp_path):
    shown = MailSettings(host="h", sender="a@b", recipients=("c@d",), user="me", password="secret!")
    assert "secret!" not in repr(shown)
    path = tmp_path / "mail.toml"
    path.write_text('host = "h"\nsender = "nobody"\nrecipients = []\n')
    with pytest.raises(ConfigurationError, match="sender"):
        load_toml(path, MailSettings)
