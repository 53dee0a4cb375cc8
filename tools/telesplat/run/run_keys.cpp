#include "tools/telesplat/run/run_keys.h"

#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <fcntl.h>
#include <chrono>
#include <filesystem>
#include <vector>

#include "common/core/descriptor.h"
#include "common/net/keys/access.h"
#include "common/net/runtime_folder.h"
#include "common/net/session_file.h"
#include "common/options/complain.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBegin = "keys-";
constexpr std::chrono::seconds kYoung{60};  // a younger folder may be about to be locked

// Removes keys of runs that were killed: no process has their folders open.
void remove_left_behind(const net::RuntimeFolder& runtime) {
  for (const auto& name : runtime.names()) {
    const std::string path = runtime.path() + "/" + name;
    std::error_code error;
    const auto changed = fs::last_write_time(path, error);
    if (!name.starts_with(kBegin) || error || fs::file_time_type::clock::now() - changed < kYoung) continue;
    const Descriptor folder{::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC)};
    if (folder.get() >= 0 && flock(folder.get(), LOCK_EX | LOCK_NB) == 0) fs::remove_all(path, error);
  }
}

Error not_made(const Error& why) {
  return Error{fmt::format("--keys auto: {}; --keys none runs without keys", why.text)};
}

Status check(const std::string& folder, const std::vector<net::Role>& roles, bool binds) {
  const auto access = net::Access::open({}, folder, roles, binds);
  return access ? ok_status() : Status(access.error());
}

}  // namespace

Result<std::unique_ptr<PassingKeys>> PassingKeys::make() {
  const auto folder = net::RuntimeFolder::make();
  if (!folder) return not_made(folder.error());
  remove_left_behind(*folder);
  const std::string path = fmt::format("{}/{}{}", folder->path(), kBegin, getpid());
  std::error_code error;
  fs::remove_all(path, error);  // a killed process may have had this number
  auto maker = net::KeyMaker::open(path);
  if (!maker) return not_made(maker.error());
  std::unique_ptr<PassingKeys> out(new PassingKeys(path, *std::move(maker)));
  if (const auto made = out->maker_.make_missing(); !made) return not_made(made.error());
  return out;
}

PassingKeys::~PassingKeys() {
  std::error_code error;
  fs::remove_all(path_, error);
}

Result<std::unique_ptr<PassingKeys>> settle_keys(RunOptions& o) {
  std::unique_ptr<PassingKeys> out;
  const bool joins = !o.join_master.empty();
  if (o.keys == net::kNoKeys) {
    o.keys.clear();
    if (!joins) complain({"--keys none: everybody on this machine can watch and end this session"});
  }
  if (o.keys.empty()) return out;
  if (o.keys == kKeysAuto) {
    auto made = PassingKeys::make();
    if (!made) return made;
    out = *std::move(made);
    o.keys = out->path();
    return out;
  }
  o.keys = net::absolute_path(o.keys);
  using enum net::Role;
  if (const Status s = check(o.keys, {kViewer, kOperator}, false); !s) return s.error();
  if (joins) return out;
  for (const net::Role role : {kData, kPacker, kSampler, kOperator})
    if (const Status s = check(o.keys, {role}, role == kData || role == kPacker); !s) return s.error();
  return out;
}

}  // namespace telesplat::launcher
