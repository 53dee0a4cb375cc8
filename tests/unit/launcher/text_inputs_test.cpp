// Texts that commands read as a whole: files without an end, and files beyond the limit, are refused at once.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "client/stereo/autostereo/panel_file.h"
#include "client/wall/wall.h"
#include "common/colour/paraview_json.h"
#include "common/geometry/trajectory.h"
#include "tests/support/files/own_folder.h"
#include "tools/common/json_file.h"
#include "tools/telesplat/record/recorded_run.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMiB = 1 << 20;

struct Input {
  std::string name, file;
  std::function<std::string(const std::string& path)> refusal;  // empty: it was read
  uint64_t limit;                                               // bytes
};
void PrintTo(const Input& i, std::ostream* out) { *out << i.name; }

template <class Read>
auto refusal_of(Read read) {
  return [read](const std::string& path) {
    const auto out = read(path);
    return out.ok() ? std::string() : out.error().text;
  };
}

const auto kRecordedRun =
    refusal_of([](const std::string& path) { return read_recorded_run(fs::path(path).parent_path()); });
const Input kInputs[] = {
    {"Trajectory", "head.csv", refusal_of(geometry::Trajectory::read_csv), 4096 * kMiB},
    {"Wall", "wall.toml", refusal_of(wall::read_wall), kMiB},
    {"Panel", "panel.toml", refusal_of(stereo::read_panel), kMiB},
    {"ColourMap", "map.json", refusal_of(colour::read_map_file), 4 * kMiB},
    {"Session", "session.toml", kRecordedRun, 64 * kMiB},
    {"Frames", "frames.csv", kRecordedRun, 4096 * kMiB},
    {"Json", "summary.json", refusal_of(tools::read_json_object), 64 * kMiB},
};

class TextInput : public testing::TestWithParam<Input> {
 protected:
  // Returns a path in a new run folder that lacks nothing else.
  std::string path() const {
    const std::string folder = tests::own_folder() + GetParam().name;
    fs::remove_all(folder);
    fs::create_directories(folder);
    std::ofstream(folder + "/session.toml") << "[scene]\nkind = \"mesh\"\nfile = \"a.ply\"\n[[process]]\n"
                                               "role = \"viewer\"\nname = \"viewer-1\"\nwidth = \"64\"\n"
                                               "height = \"40\"\nfov_deg = \"90\"\n";
    fs::remove(folder + "/" + GetParam().file);
    return folder + "/" + GetParam().file;
  }
  void expect_refusal(const std::string& file, const std::string& said) const {
    const std::string text = GetParam().refusal(file);
    EXPECT_NE(text.find(file), std::string::npos) << text;
    EXPECT_NE(text.find(said), std::string::npos) << text;
  }
};

TEST_P(TextInput, WithoutAnEndIsRefused) {
  std::string file = path();
  ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
  expect_refusal(file, "is not a regular file");
  file = path();
  fs::create_symlink("/dev/zero", file);
  expect_refusal(file, "is not a regular file");
}

TEST_P(TextInput, BeyondTheLimitIsRefused) {
  const std::string file = path();
  const uint64_t limit = GetParam().limit;
  std::ofstream(file) << '\n';
  fs::resize_file(file, limit + 1);
  expect_refusal(file, fmt::format("has {} bytes, limit {}", limit + 1, limit));
}

INSTANTIATE_TEST_SUITE_P(All, TextInput, testing::ValuesIn(kInputs), [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace telesplat::launcher
