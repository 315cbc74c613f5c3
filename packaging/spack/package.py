# A recipe for Spack: put this folder into a repository of yours as packages/corpuscle (spack repo create, spack repo add).
from spack.package import *


class Corpuscle(CMakePackage, CudaPackage, ROCmPackage):
    """Red blood cells in flowing plasma: an immersed-boundary solver coupled to membranes, on processors and devices."""

    license("BSD-3-Clause")

    version("main", branch="main")

    variant("openmp", default=True, description="Threads of the host")
    variant("mpi", default=True, description="Ranks")
    variant("hdf5", default=True, description="Fields, cells and checkpoints")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.21:", type="build")
    depends_on("ninja", type="build")
    generator("ninja")

    depends_on("kokkos@3.4:")
    depends_on("kokkos-kernels@3.4:")
    depends_on("hypre@2.26:")
    depends_on("fmt")
    depends_on("spdlog +fmt_external")
    depends_on("nlohmann-json")
    depends_on("cli11")
    depends_on("tomlplusplus")
    depends_on("qhull")
    depends_on("kokkos+openmp", when="+openmp")
    depends_on("hypre+openmp", when="+openmp")
    depends_on("mpi", when="+mpi")
    depends_on("hypre+mpi", when="+mpi")
    depends_on("hypre~mpi", when="~mpi")
    depends_on("hdf5", when="+hdf5")
    depends_on("hdf5+mpi", when="+hdf5+mpi")

    for _arch in CudaPackage.cuda_arch_values:
        depends_on(f"kokkos+cuda+cuda_constexpr+wrapper cuda_arch={_arch}", when=f"+cuda cuda_arch={_arch}")
        depends_on(f"hypre+cuda cuda_arch={_arch}", when=f"+cuda cuda_arch={_arch}")
    for _target in ROCmPackage.amdgpu_targets:
        depends_on(f"kokkos+rocm amdgpu_target={_target}", when=f"+rocm amdgpu_target={_target}")
        depends_on(f"hypre+rocm amdgpu_target={_target}", when=f"+rocm amdgpu_target={_target}")
    conflicts("+cuda", when="+rocm")

    def cmake_args(self):
        spec = self.spec
        args = [
            self.define_from_variant("CORPUSCLE_MPI", "mpi"),
            self.define_from_variant("CORPUSCLE_HDF5", "hdf5"),
            self.define("CORPUSCLE_DEPS", ""),
            self.define("CORPUSCLE_NATIVE", False),
            self.define("CORPUSCLE_TESTS", self.run_tests),
            self.define("CORPUSCLE_STUDIES", False),
        ]
        if spec.satisfies("+cuda"):
            args.append(self.define("CMAKE_CXX_COMPILER", spec["kokkos-nvcc-wrapper"].kokkos_cxx))
        elif spec.satisfies("+rocm"):
            args.append(self.define("CMAKE_CXX_COMPILER", spec["hip"].hipcc))
        return args
