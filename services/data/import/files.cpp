#include "services/data/import/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostPath = 4096;

// A message with a path and a descriptor.
struct Packet {
  char path[kMostPath];
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  iovec text{path, sizeof path};
  msghdr message{};

  Packet() {
    message.msg_iov = &text, message.msg_iovlen = 1;
    message.msg_control = control, message.msg_controllen = sizeof control;
  }
};

bool send(int socket, const std::string& path, int descriptor) {
  Packet packet;
  std::memcpy(packet.path, path.data(), path.size());
  packet.text.iov_len = path.size();
  cmsghdr* const control = CMSG_FIRSTHDR(&packet.message);
  control->cmsg_level = SOL_SOCKET, control->cmsg_type = SCM_RIGHTS, control->cmsg_len = CMSG_LEN(sizeof descriptor);
  std::memcpy(CMSG_DATA(control), &descriptor, sizeof descriptor);
  ssize_t sent;
  do sent = sendmsg(socket, &packet.message, MSG_NOSIGNAL);
  while (sent < 0 && errno == EINTR);
  return sent >= 0;
}

}  // namespace

void send_files(int socket, const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (path.empty() || path.size() > kMostPath) continue;
    // O_NONBLOCK: opening a pipe given by mistake must not block.
    const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) continue;
    struct stat status {};
    const bool regular = fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
    const bool goes_on = !regular || send(socket, path, descriptor);
    close(descriptor);
    if (!goes_on) return;
  }
}

uint64_t ImportFile::size() const {
  struct stat status {};
  return fstat(descriptor_, &status) == 0 ? uint64_t(status.st_size) : 0;
}

ImportFiles::ImportFiles(int socket) {
  rlimit most{};  // limit of open files: folders of slices have thousands
  if (getrlimit(RLIMIT_NOFILE, &most) == 0) most.rlim_cur = most.rlim_max, setrlimit(RLIMIT_NOFILE, &most);
  for (;;) {
    Packet packet;
    const ssize_t bytes = recvmsg(socket, &packet.message, MSG_CMSG_CLOEXEC);
    if (bytes < 0 && errno == EINTR) continue;
    const cmsghdr* const control = bytes > 0 ? CMSG_FIRSTHDR(&packet.message) : nullptr;
    if (!control || control->cmsg_type != SCM_RIGHTS) return;
    int descriptor;
    std::memcpy(&descriptor, CMSG_DATA(control), sizeof descriptor);
    files_.emplace_back(std::string(packet.path, size_t(bytes)), descriptor);
  }
}

uint64_t ImportFiles::bytes() const {
  uint64_t sum = 0;
  for (const ImportFile& file : files_) sum += file.size();
  return sum;
}

Result<std::string_view> ImportFiles::content_of(const ImportFile& file) {
  auto content = file.map();
  if (!content) return content.error();
  mapped_.push_back(*content);
  return (*content)->text();
}

Result<std::string_view> ImportFiles::content() {
  if (files_.empty()) return Error{"the file to be read did not arrive"};
  return content_of(files_[0]);
}

Result<std::string_view> ImportFiles::read(const std::string& named) {
  const fs::path path = files_.empty() ? fs::path(named) : fs::path(files_[0].path()).parent_path() / named;
  for (const ImportFile& file : files_)
    if (fs::path(file.path()).lexically_normal() == path.lexically_normal()) return content_of(file);
  return Error{fmt::format("{}: there is no such file, or it may not be read", path.string())};
}

}  // namespace telesplat::data
