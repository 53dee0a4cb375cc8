// The keys of a run: a folder that is given, or throw-away ones.
#pragma once

#include <memory>
#include <string>

#include "common/core/result.h"
#include "common/net/keys/key_maker.h"
#include "tools/telesplat/run/run_options.h"

namespace telesplat::launcher {

/// As values of --keys: keys that are made for this run.
inline constexpr const char* kKeysAuto = "auto";

/// Keys that are made for one run, in the user's runtime folder; they go when it does.
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
  net::KeyMaker maker_;  // as long as it is open, others know that the keys are in use
};

/// Checks that options.keys has a key for each process that will be started; "auto" becomes a folder of new ones, and
/// "none" becomes empty, after a line on stderr that says what this means. Returns the new keys; null: there is nothing
/// that would have to go. Error: what is missing or wrong.
Result<std::unique_ptr<PassingKeys>> settle_keys(RunOptions& options);

}  // namespace telesplat::launcher
