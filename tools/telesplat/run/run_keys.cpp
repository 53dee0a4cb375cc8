#include "tools/telesplat/run/run_keys.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "common/net/keys/access.h"
#include "common/net/keys/key_maker.h"
#include "common/net/runtime_folder.h"
#include "common/net/session_file.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMade = "auto";

Status check(const std::string& folder, const std::vector<net::Role>& roles, bool binds) {
  const auto access = net::Access::open({}, folder, roles, binds);
  return access ? ok_status() : Status(access.error());
}

}  // namespace

Result<std::unique_ptr<PassingKeys>> PassingKeys::make() {
  const auto folder = net::RuntimeFolder::make();
  if (!folder) return Error{"--keys auto: " + folder.error().text};
  const std::string path = fmt::format("{}/keys-{}", folder->path(), getpid());
  std::error_code error;
  fs::remove_all(path, error);  // of a process of this number that was killed
  auto maker = net::KeyMaker::open(path);
  if (!maker) return Error{"--keys auto: " + maker.error().text};
  std::unique_ptr<PassingKeys> out(new PassingKeys(path));
  if (const auto made = maker->make_missing(); !made) return Error{"--keys auto: " + made.error().text};
  return out;
}

PassingKeys::~PassingKeys() {
  std::error_code error;
  fs::remove_all(path_, error);
}

Result<std::unique_ptr<PassingKeys>> settle_keys(RunOptions& o) {
  std::unique_ptr<PassingKeys> out;
  if (o.keys.empty()) return out;
  const bool joins = !o.join_master.empty();
  if (o.keys == kMade) {
    if (joins) return Error{"--keys auto: a session that is joined has its own keys"};
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
