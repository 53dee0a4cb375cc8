// The keys of a run: a given folder, or keys made for this run alone.
#pragma once

#include <memory>
#include <string>

#include "common/core/result.h"
#include "common/net/keys/key_maker.h"
#include "tools/telesplat/run/run_options.h"

namespace telesplat::launcher {

/// Value of --keys: keys made for this run.
inline constexpr const char* kKeysAuto = "auto";

/// Keys made for one run, in the user's runtime folder; the destructor deletes them.
class PassingKeys {
 public:
  static Result<std::unique_ptr<PassingKeys>> make();
  ~PassingKeys();
  PassingKeys(const PassingKeys&) = delete;
  PassingKeys& operator=(const PassingKeys&) = delete;
  const std::string& path() const { return path_; }

 private:
  PassingKeys(std::string path, net::KeyMaker maker) : path_(std::move(path)), maker_(std::move(maker)) {}
  std::string path_;
  net::KeyMaker maker_;  // open as long as the keys are in use: other processes see that
};

/// Checks that options.keys has a key for each process that will be started; "auto" becomes a folder of new ones, and
/// "none" becomes empty, after a line on stderr that says what this means. Returns the new keys; null: no keys were
/// made. Error: names the missing or wrong key.
Result<std::unique_ptr<PassingKeys>> settle_keys(RunOptions& options);

}  // namespace telesplat::launcher
