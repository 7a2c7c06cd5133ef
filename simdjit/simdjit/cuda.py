"""One NVIDIA GPU by its driver, which every machine with such a GPU has: memory, programs, launches."""

import contextlib
import ctypes
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

# CUdevice_attribute: major and minor number of what the device can do.
_MAJOR, _MINOR = 75, 76

# CU_STREAM_PER_THREAD: threads of this process do not wait for one another.
_STREAM = ctypes.c_void_p(2)


class Driver:
    """The first GPU, in the context that JAX uses as well.

    Args:
        library: the driver's functions; those of this machine unless given.

    Attributes:
        generation: 10 times its compute capability.

    Raises:
        OSError: there is no driver or no GPU.
    """

    def __init__(self, library: Any = None):
        self._library = ctypes.CDLL("libcuda.so.1") if library is None else library
        self._call("cuInit", ctypes.c_uint(0))
        device = self._answer("cuDeviceGet", ctypes.c_int, ctypes.c_int(0))
        attribute = lambda which: self._answer("cuDeviceGetAttribute", ctypes.c_int, ctypes.c_int(which), device).value
        self.generation = 10 * attribute(_MAJOR) + attribute(_MINOR)
        self._context = self._answer("cuDevicePrimaryCtxRetain", ctypes.c_void_p, device)

    def load(self, assembly: str, name: str) -> ctypes.c_void_p:
        """A kernel of a program, compiled for this GPU."""
        self._enter()
        module = self._answer("cuModuleLoadData", ctypes.c_void_p, ctypes.c_char_p(assembly.encode()))
        return self._answer("cuModuleGetFunction", ctypes.c_void_p, module, ctypes.c_char_p(name.encode()))

    @contextlib.contextmanager
    def room(self, sizes: Sequence[int]) -> Iterator[list[int]]:
        """Addresses of memory of the GPU; sizes in bytes."""
        self._enter()
        with contextlib.ExitStack() as taken:
            places = []
            for size in sizes:
                place = self._answer("cuMemAlloc_v2", ctypes.c_uint64, ctypes.c_size_t(max(size, 1)))
                taken.callback(self._call, "cuMemFree_v2", place)
                places.append(place.value)
            yield places

    def put(self, array: np.ndarray, place: int) -> None:
        """Copy an array to the GPU; before what is launched next."""
        source, size = ctypes.c_void_p(array.ctypes.data), ctypes.c_size_t(array.nbytes)
        self._call("cuMemcpyHtoDAsync_v2", ctypes.c_uint64(place), source, size, _STREAM)

    def get(self, place: int, array: np.ndarray) -> None:
        """Fill an array from the GPU, once everything launched is done."""
        target, size = ctypes.c_void_p(array.ctypes.data), ctypes.c_size_t(array.nbytes)
        self._call("cuMemcpyDtoHAsync_v2", target, ctypes.c_uint64(place), size, _STREAM)
        self._call("cuStreamSynchronize", _STREAM)

    def launch(self, kernel: ctypes.c_void_p, blocks: int, threads: int, arguments: Sequence[int]) -> None:
        """Start a kernel whose arguments are numbers of 64 bits and addresses; `threads` in each block."""
        words = [ctypes.c_uint64(argument) for argument in arguments]
        pointers = (ctypes.c_void_p * len(words))(*(ctypes.addressof(word) for word in words))
        shape = [ctypes.c_uint(number) for number in (blocks, 1, 1, threads, 1, 1, 0)]
        self._call("cuLaunchKernel", kernel, *shape, _STREAM, pointers, None)

    def _enter(self) -> None:
        self._call("cuCtxSetCurrent", self._context)

    def _answer(self, function: str, kind: Any, *arguments: Any) -> Any:
        """What a function of the driver puts into its first argument."""
        answer = kind()
        self._call(function, ctypes.byref(answer), *arguments)
        return answer

    def _call(self, function: str, *arguments: Any) -> None:
        code = getattr(self._library, function)(*arguments)
        if code:
            raise OSError(f"the GPU's driver refuses {function} (CUDA error {code})")
