// The golden digests of tests/simulation/digests.txt: what a session sends and shows, to the byte, on every machine.
#pragma once

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>

#include "tools/lab/simulation/command.h"

namespace telesplat::simulation {

/// Chooses glibc's plain functions, as telesplat-lab does, and one thread: other tests have the other processors.
class PlainFunctions : public ::testing::Environment {
  void SetUp() override {
    choose_plain_functions();
    threads_.emplace(tbb::global_control::max_allowed_parallelism, 1);
  }
  void TearDown() override { threads_.reset(); }
  std::optional<tbb::global_control> threads_;
};
inline const ::testing::Environment* add_plain_functions() {
  return ::testing::AddGlobalTestEnvironment(new PlainFunctions);
}

/// In hexadecimal digits, by the name of a standard walk or "seed-N".
inline std::map<std::string, std::string> golden_digests() {
  std::map<std::string, std::string> out;
  std::ifstream file("tests/simulation/digests.txt");
  for (std::string name, digest; file >> name >> digest;) out[name] = digest;
  return out;
}

inline void expect_digest(const std::map<std::string, std::string>& golden, const std::string& name, uint64_t digest) {
  const auto found = golden.find(name);
  ASSERT_NE(found, golden.end()) << "tools/update-figures writes the digest of " << name;
  EXPECT_EQ(std::stoull(found->second, nullptr, 16), digest)
      << name << " sends or shows something else than before. If that is meant, tools/update-figures writes it anew";
}

}  // namespace telesplat::simulation
