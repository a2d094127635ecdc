"""A server that can be reached from other computers answers only calls that carry its token."""

import hmac
import secrets
from collections.abc import Callable
from typing import Any

import grpc

from vibench.acquisition.rig import TOKEN_KEY, TOKEN_VARIABLE

LOOPBACK_HOSTS = frozenset({"127.0.0.1", "localhost", "[::1]"})


def token_for(address: str) -> str | None:
    """Make a token for a server at ``"host:port"``; None on loopback, which is this computer only."""
    host = address.rpartition(":")[0]
    return None if host in LOOPBACK_HOSTS else secrets.token_urlsafe(24)


class TokenRequired(grpc.ServerInterceptor):  # type: ignore[misc] # grpc ships without types
    """Turns away every call without the token."""

    def __init__(self, token: str) -> None:
        self._token = token

    def intercept_service(self, continuation: Callable[[Any], Any], details: Any) -> Any:
        """Let a call pass, or answer it with a refusal."""
        given = dict(details.invocation_metadata).get(TOKEN_KEY, "")
        if hmac.compare_digest(str(given).encode(), self._token.encode()):
            return continuation(details)
        return grpc.unary_unary_rpc_method_handler(_refuse)


def _refuse(request: Any, context: grpc.ServicerContext) -> None:  # noqa: ARG001 - the request does not matter
    context.abort(
        grpc.StatusCode.UNAUTHENTICATED,
        f"this rig is served with a token: put what 'vibench serve-rig' printed into {TOKEN_VARIABLE}",
    )
