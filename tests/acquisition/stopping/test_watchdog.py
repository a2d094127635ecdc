"""The watchdog repeats its check even if a check has failed."""

from threading import Event

from vibench.acquisition.stopping.program import Watchdog


def test_a_watchdog_thread_continues_after_a_failed_check(caplog):
    looks, thrice = [], Event()

    def look():
        looks.append(None)
        if len(looks) == 3:
            thrice.set()
        raise ValueError(len(looks))

    watchdog = Watchdog(look, "watchdog")
    assert thrice.wait(20)
    watchdog.close()
    assert caplog.records[0].exc_info[0] is ValueError
