// Confines a process that runs foreign parsers: it may compute, and write into files that are open already.
#pragma once

#include <cstdint>
#include <string>

namespace telesplat::data {

/// Denies this process, as far as the kernel can: opening files other than the system's libraries and tables below
/// /usr, /lib and /etc/ld.so.cache (Landlock); writing any file; sockets, programs, other processes (seccomp); memory
/// beyond `memory_bytes`, and beyond three quarters of the machine's; output beyond that, too; core files.
void confine(uint64_t memory_bytes);

/// Returns the protections that this kernel lacks, for users; empty: it has all.
std::string not_confined();

}  // namespace telesplat::data
