"""The functions of NVIDIA's driver that `cuda.Driver` calls, on this processor: thread after thread, from LLVM's assembly."""

import ctypes
import itertools
import re

from llvmlite import binding

from simdjit import cpu

_KERNEL = ctypes.CFUNCTYPE(None, *[ctypes.c_uint64] * 9)
_REGISTER = """
@{0} = global i32 0
define i32 @register.{0}.x() {{
  %value = load i32, ptr @{0}
  ret i32 %value
}}"""


class EmulatedGpu:
    """Programs come as LLVM's assembly: `nvidia.ptx` must leave it as it is."""

    def __init__(self, memory=1 << 40):
        self.kernels, self.buffers, self.left, self.launches = [], {}, memory, []

    def cuInit(self, flags):
        return 0

    def cuDeviceGet(self, found, number):
        return self._give(found, 0)

    def cuDeviceGetAttribute(self, found, which, device):
        return self._give(found, {75: 9, 76: 0}[which.value])

    def cuDevicePrimaryCtxRetain(self, found, device):
        return self._give(found, 1)

    def cuCtxSetCurrent(self, context):
        assert context.value == 1
        return 0

    def cuModuleLoadData(self, found, image):
        text = re.sub(r"declare i32 @llvm.nvvm\S+\n", "", image.value.decode()).replace("ptx_kernel ", "")
        text = text.replace("llvm.nvvm.read.ptx.sreg.", "register.") + "".join(
            map(_REGISTER.format, ("ctaid", "ntid", "tid"))
        )
        engine = binding.create_mcjit_compiler(binding.parse_assembly(text), cpu._target(level=0))
        engine.finalize_object()
        self.kernels.append(engine)
        return self._give(found, len(self.kernels))

    def cuModuleGetFunction(self, found, module, name):
        assert name.value == b"run"
        return self._give(found, module.value)

    def cuMemAlloc_v2(self, found, size):
        if size.value > self.left:
            return 2  # CUDA_ERROR_OUT_OF_MEMORY
        buffer = ctypes.create_string_buffer(b"\xff" * size.value, size.value)
        self.buffers[ctypes.addressof(buffer)] = buffer
        self.left -= size.value
        return self._give(found, ctypes.addressof(buffer))

    def cuMemFree_v2(self, place):
        self.left += len(self.buffers.pop(place.value))
        return 0

    def cuMemcpyHtoDAsync_v2(self, place, source, size, stream):
        ctypes.memmove(place.value, source.value, size.value)
        return 0

    def cuMemcpyDtoHAsync_v2(self, target, place, size, stream):
        ctypes.memmove(target.value, place.value, size.value)
        return 0

    def cuStreamSynchronize(self, stream):
        return 0

    def cuLaunchKernel(self, kernel, x, y, z, threads, more, most, shared, stream, pointers, extra):
        assert (y.value, z.value, more.value, most.value, shared.value, extra) == (1, 1, 1, 1, 0, None)
        engine = self.kernels[kernel.value - 1]
        run = _KERNEL(engine.get_function_address("run"))
        given = [ctypes.c_uint64.from_address(pointer).value for pointer in pointers]
        block, size, thread = (
            ctypes.c_int32.from_address(engine.get_global_value_address(name)) for name in ("ctaid", "ntid", "tid")
        )
        self.launches.append((x.value, threads.value))
        size.value = threads.value
        for block.value, thread.value in itertools.product(range(x.value), range(threads.value)):
            run(*given)
        return 0

    @staticmethod
    def _give(found, value):
        found._obj.value = value
        return 0
