#include "services/data/import/confine.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace telesplat::data {
namespace {

int landlock_version() {
  return int(syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION));
}

void limit(int resource, uint64_t most) {
  const rlimit both{most, most};
  setrlimit(__rlimit_resource(resource), &both);
}

// Denies all accesses that the first version of Landlock knows; seccomp denies those of later versions.
void close_files() {
  constexpr uint64_t kAll = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;
  constexpr uint64_t kReading = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
  const landlock_ruleset_attr attributes{.handled_access_fs = kAll};
  const int rules = int(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0));
  if (rules < 0) return;
  for (const char* folder : {"/usr", "/lib", "/lib64", "/etc/ld.so.cache"}) {
    landlock_path_beneath_attr beneath{.allowed_access = kReading, .parent_fd = open(folder, O_PATH | O_CLOEXEC)};
    if (beneath.parent_fd < 0) continue;
    if (folder == std::string("/etc/ld.so.cache")) beneath.allowed_access = LANDLOCK_ACCESS_FS_READ_FILE;
    syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0);
    close(beneath.parent_fd);
  }
  syscall(SYS_landlock_restrict_self, rules, 0);
  close(rules);
}

// Sockets; programs and other processes; files' sizes, owners and times; mounts; keys; ways around the file system.
// clang-format off
constexpr int kDenied[] = {
    SCMP_SYS(socket), SCMP_SYS(socketpair), SCMP_SYS(connect), SCMP_SYS(bind), SCMP_SYS(listen),
    SCMP_SYS(accept), SCMP_SYS(accept4), SCMP_SYS(sendto), SCMP_SYS(sendmsg), SCMP_SYS(sendmmsg),
    SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(fork), SCMP_SYS(vfork), SCMP_SYS(kill),
    SCMP_SYS(tkill), SCMP_SYS(ptrace), SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev), SCMP_SYS(pidfd_open),
    SCMP_SYS(pidfd_getfd), SCMP_SYS(truncate), SCMP_SYS(ftruncate), SCMP_SYS(chmod), SCMP_SYS(fchmod),
    SCMP_SYS(fchmodat), SCMP_SYS(chown), SCMP_SYS(fchown), SCMP_SYS(lchown), SCMP_SYS(fchownat),
    SCMP_SYS(utime), SCMP_SYS(utimes), SCMP_SYS(utimensat), SCMP_SYS(setxattr), SCMP_SYS(lsetxattr),
    SCMP_SYS(fsetxattr), SCMP_SYS(mount), SCMP_SYS(umount2), SCMP_SYS(pivot_root), SCMP_SYS(chroot),
    SCMP_SYS(unshare), SCMP_SYS(setns), SCMP_SYS(keyctl), SCMP_SYS(add_key), SCMP_SYS(request_key),
    SCMP_SYS(bpf), SCMP_SYS(perf_event_open), SCMP_SYS(userfaultfd), SCMP_SYS(io_uring_setup), SCMP_SYS(open_by_handle_at),
    SCMP_SYS(name_to_handle_at), SCMP_SYS(shmget), SCMP_SYS(shmat), SCMP_SYS(msgget), SCMP_SYS(semget),
    SCMP_SYS(mq_open), SCMP_SYS(memfd_create),
};
// clang-format on

// Denied calls fail; they do not end the process.
void close_calls() {
  const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
  if (!filter) return;
  for (const int call : kDenied) seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), call, 0);
  // Without Landlock, files can still be read, but not written.
  for (const auto& [call, argument] : {std::pair{SCMP_SYS(open), 1u}, std::pair{SCMP_SYS(openat), 2u}})
    for (const scmp_datum_t how : {O_WRONLY, O_RDWR})
      seccomp_rule_add(filter, SCMP_ACT_ERRNO(EACCES), call, 1,
                       scmp_arg_cmp{argument, SCMP_CMP_MASKED_EQ, O_ACCMODE, how});
  for (const int call : {SCMP_SYS(openat2), SCMP_SYS(creat)}) seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), call, 0);
  seccomp_load(filter);
  seccomp_release(filter);
}

}  // namespace

void confine(uint64_t memory_bytes) {
  limit(RLIMIT_CORE, 0);
  const uint64_t machine = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
  const uint64_t most = std::min(memory_bytes, machine / 4 * 3);
  limit(RLIMIT_FSIZE, most);
#ifndef TELESPLAT_SANITIZED  // sanitizers map terabytes of shadow, and write into files
  limit(RLIMIT_AS, most);
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  close_files();
  close_calls();
#endif
}

std::string not_confined() {
  std::string out;
  if (landlock_version() < 0) out = "Landlock, which keeps files closed";
  if (prctl(PR_GET_SECCOMP, 0, 0, 0, 0) < 0)
    out += std::string(out.empty() ? "" : "; ") + "seccomp, which denies sockets";
  return out;
}

}  // namespace telesplat::data
