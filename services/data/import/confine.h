// What a process that runs other people's parsers may do: compute, and write into what is open already.
#pragma once

#include <cstdint>
#include <string>

namespace telesplat::data {

/// Takes from this process, as far as the kernel offers it: opening files other than the system's libraries and tables
/// below /usr, /lib and /etc/ld.so.cache (Landlock), writing any; sockets, programs, other processes (seccomp); memory
/// beyond `memory_bytes`, three quarters of the machine's at most; output beyond that, too; core files.
void confine(uint64_t memory_bytes);

/// What of that this kernel does not offer, for people; empty: it offers all.
std::string not_confined();

}  // namespace telesplat::data
