"""Many runs at once in machine code: loops written for one run, compiled for the lanes of vector registers.

A traced function becomes the arithmetic of its scalars (`scalarise`, `graph`), that becomes instructions in which every
number is a vector over lanes (`emit`), and LLVM makes them machine code, of this processor (`machine`) or of a GPU,
where every lane is a thread (`nvidia`). Sums and products are never contracted and functions are made of them, so that
a result has the same bits on every processor, in every lane, and whoever flies beside it.
"""
