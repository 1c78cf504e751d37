"""What `Host`, `Channel` and `Robot` share: they close at the end of a `with`, and refuse an attribute that they do not have."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Self


class Strict:
    """Refuses to set an attribute that its class does not have: `robot.srvo = True` would change nothing. The classes have `__slots__`."""

    __slots__ = ()

    # Type checkers know the attributes, and would take any name if they saw this.
    if not TYPE_CHECKING:

        def __setattr__(self, name: str, value: object) -> None:
            try:
                super().__setattr__(name, value)
            except AttributeError:
                if hasattr(type(self), name):
                    raise
                near = difflib.get_close_matches(name, [one for one in dir(self) if not one.startswith("_")], 1)
                hint = f"; did you mean {near[0]!r}?" if near else ""
                raise AttributeError(f"{type(self).__name__} has no attribute {name!r}{hint}") from None


class Closing(Strict):
    """Closes at the end of a `with`."""

    __slots__ = ()

    def close(self) -> object:
        """Closes it."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
