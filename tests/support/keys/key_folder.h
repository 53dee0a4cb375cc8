// A folder of keys that the destructor deletes.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "common/net/keys/access.h"
#include "common/net/keys/key_maker.h"

namespace telesplat::test {

class KeyFolder {
 public:
  KeyFolder() {
    static std::atomic<int> counter{0};
    path_ = std::filesystem::temp_directory_path() /
            ("telesplat-keys-test-" + std::to_string(getpid()) + "-" + std::to_string(++counter));
    std::filesystem::remove_all(path_);
    const auto made = net::KeyMaker::open(path_)->make_missing();
    EXPECT_TRUE(made.ok());
  }
  ~KeyFolder() { std::filesystem::remove_all(path_); }
  KeyFolder(const KeyFolder&) = delete;

  const std::string& path() const { return path_; }
  net::KeyMaker maker() const {
    auto opened = net::KeyMaker::open(path_);
    EXPECT_TRUE(opened.ok());
    return *std::move(opened);
  }

  /// Access of a process that binds, and connects by the key of `role`.
  net::Access server(net::Role role = net::Role::kPacker) const { return access({role}, true); }
  net::Access of(net::Role role) const { return access({role}, false); }
  /// Access by the key of this name.
  net::Access named(const std::string& name) const {
    auto keys = net::read_keys(path_, {}, false);
    EXPECT_TRUE(keys.ok());
    keys->own = *net::read_named_key(path_, name);
    return {{}, *std::move(keys)};
  }

 private:
  net::Access access(const std::vector<net::Role>& roles, bool binds) const {
    auto made = net::Access::open({}, path_, roles, binds);
    EXPECT_TRUE(made.ok()) << (made ? "" : made.error().text);
    return *std::move(made);
  }

  std::string path_;
};

}  // namespace telesplat::test
