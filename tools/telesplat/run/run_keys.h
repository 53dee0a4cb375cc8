// The keys of a run: a folder that is given, or throw-away ones.
#pragma once

#include <memory>
#include <string>

#include "common/core/result.h"
#include "tools/telesplat/run/run_options.h"

namespace telesplat::launcher {

/// Keys that are made for one run, in the user's runtime folder; they go when it does.
class PassingKeys {
 public:
  static Result<std::unique_ptr<PassingKeys>> make();
  ~PassingKeys();
  PassingKeys(const PassingKeys&) = delete;
  PassingKeys& operator=(const PassingKeys&) = delete;
  const std::string& path() const { return path_; }

 private:
  explicit PassingKeys(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

/// Checks that options.keys has a key for each process that will be started; "auto" becomes a folder of new ones.
/// Returns these; null: there is nothing that would have to go. Error: what is missing or wrong.
Result<std::unique_ptr<PassingKeys>> settle_keys(RunOptions& options);

}  // namespace telesplat::launcher
