"""Ready-made settings of the law: the paper's, and the sound one."""
