"""Arrays as they are given, made what the extension module takes, or refused in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


def floats(name: str, value: ArrayLike, dtype: Any = None) -> NDArray[Any]:
    """A contiguous array of floats of what is given.

    Raises:
        TypeError: It holds no real numbers.
    """
    import numpy as np

    try:
        array = np.asarray(value)
    except ValueError as error:
        raise TypeError(f"`{name}` is no array: {error}") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"`{name}` has the dtype {array.dtype}: expected real numbers")
    with np.errstate(over="ignore"):
        return np.asarray(array, dtype=dtype or np.float32, order="C")


def finite(name: str, array: NDArray[Any]) -> NDArray[Any]:
    """The array, if all of it is finite.

    Raises:
        ValueError: The first number that is not, and its row.
    """
    import numpy as np

    bad = ~np.isfinite(array)
    if bad.any():
        at = tuple(int(index) for index in np.argwhere(bad)[0])
        raise ValueError(f"`{name}` has {array[at]} at {list(at)}: expected finite numbers")
    return array


def rows(name: str, value: ArrayLike, width: int, dtype: Any = None) -> NDArray[Any]:
    """An array of shape (any, ``width``).

    Raises:
        TypeError: It holds no real numbers.
        ValueError: It has another shape, or numbers that are not finite.
    """
    array = floats(name, value, dtype)
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"`{name}` has the shape {array.shape}: expected (any, {width})")
    return finite(name, array)


def indices(name: str, value: ArrayLike, width: int) -> NDArray[np.uint32]:
    """An array of indices of shape (any, ``width``).

    Raises:
        TypeError: It holds no integers.
        ValueError: It has another shape, or numbers that are no indices.
    """
    import numpy as np

    array = np.asarray(value)
    if array.dtype.kind not in "iu":
        raise TypeError(f"`{name}` has the dtype {array.dtype}: expected integers")
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"`{name}` has the shape {array.shape}: expected (any, {width})")
    if array.size and (array.min() < 0 or array.max() > np.iinfo(np.uint32).max):
        raise ValueError(f"`{name}` has numbers from {array.min()} to {array.max()}: expected indices from 0")
    return np.ascontiguousarray(array, dtype=np.uint32)


def items(
    given: Mapping[str, ArrayLike | None], fields: Mapping[str, int]
) -> tuple[tuple[int, ...], list[tuple[str, NDArray[np.float32]]]]:
    """The common shape of the items, and of each field its rows: one an item, or one for all.

    Raises:
        TypeError: A field is unknown, or holds no real numbers.
        ValueError: Shapes do not go together.
    """
    import numpy as np

    arrays: dict[str, NDArray[Any]] = {}
    for name, value in given.items():
        if value is None:
            continue
        if name not in fields:
            raise TypeError(f"there is no input `{name}`: the inputs are {', '.join(fields)}")
        array, width = floats(name, value), fields[name]
        if width == 1:
            array = array[..., None]
        elif array.ndim == 0 or array.shape[-1] != width:
            raise ValueError(f"`{name}` has the shape {array.shape}: expected (..., {width})")
        arrays[name] = array
    try:
        shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays.values()))
    except ValueError:
        shown = ", ".join(f"`{name}` has {array.shape[:-1]}" for name, array in arrays.items())
        raise ValueError(f"the items' shapes do not go together: {shown}") from None

    def flat(array: NDArray[Any]) -> NDArray[np.float32]:
        if array[..., 0].size == 1:
            return array.reshape(-1)
        return np.ascontiguousarray(np.broadcast_to(array, (*shape, array.shape[-1]))).reshape(-1)

    return shape, [(name, flat(array)) for name, array in arrays.items()]
