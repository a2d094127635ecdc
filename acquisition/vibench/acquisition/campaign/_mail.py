"""E-mail about a campaign: settings from a file of the user's own, and one message a notice."""

import smtplib
import ssl
from collections.abc import Mapping
from email.message import EmailMessage
from enum import StrEnum

from pydantic import Field, PositiveFloat, PositiveInt, SecretStr

from ..host import FrozenModel


class Security(StrEnum):
    """How the way to the mail server is protected."""

    STARTTLS = "starttls"
    TLS = "tls"
    NONE = "none"
    """Plain text: only for a server on this computer."""


class MailSettings(FrozenModel):
    """Where mail goes, and through which server. Keep the file to yourself: it may hold a password."""

    host: str = Field(min_length=1)
    port: PositiveInt = 587
    security: Security = Security.STARTTLS
    sender: str = Field(pattern=r"^[^@\s]+@[^@\s]+$")
    recipients: tuple[str, ...] = Field(min_length=1)
    user: str = ""
    """Empty for a server that asks for none."""
    password: SecretStr = SecretStr("")
    timeout_s: PositiveFloat = Field(default=20.0, le=300)


class MailMessenger:
    """Sends each notice as a message."""

    def __init__(self, settings: MailSettings) -> None:
        self._settings = settings

    def send(self, notice: Mapping[str, str | int | float]) -> str:
        """Send one message; says in a clause how that went."""
        settings = self._settings
        try:
            with self._connected() as server:
                if settings.security is Security.STARTTLS:
                    server.starttls(context=ssl.create_default_context())
                if settings.user:
                    server.login(settings.user, settings.password.get_secret_value())
                server.send_message(self._message(notice))
        except (OSError, smtplib.SMTPException) as error:
            return f"mail through {settings.host} failed ({error})"
        return f"mail sent to {', '.join(settings.recipients)}"

    def _message(self, notice: Mapping[str, str | int | float]) -> EmailMessage:
        message = EmailMessage()
        message["Subject"] = f"vibench: {notice['campaign']}: {notice['event']}"
        message["From"] = self._settings.sender
        message["To"] = ", ".join(self._settings.recipients)
        message.set_content("\n".join(f"{key}: {value}" for key, value in notice.items()) + "\n")
        return message

    def _connected(self) -> smtplib.SMTP:
        settings = self._settings
        if settings.security is Security.TLS:
            context = ssl.create_default_context()
            return smtplib.SMTP_SSL(settings.host, settings.port, timeout=settings.timeout_s, context=context)
        return smtplib.SMTP(settings.host, settings.port, timeout=settings.timeout_s)
