// Clouds in files that are compressed, or have parts. Programs in tests/support/files write those of made-up points:
// laz_files.py and e57_files.py.
#include "services/data/base/refusal.h"
#include "services/data/cloud/laz/laz.h"
#include "services/data/cloud/readers.h"
#include "tests/unit/data/cloud/read_cloud.h"

namespace telesplat::data::test {
namespace {

using namespace std::string_literals;

constexpr size_t kHeader = 227, kItems = kHeader + 54 + 34;  // in LAS 1.2

std::string made_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return std::string((std::istreambuf_iterator<char>(in)), {});
}
std::string made(const std::string& name) { return made_bytes("tests/fuzz/corpus/las/" + name); }

struct Packed {
  const char* name;
  uint64_t hash;  // that of all points
};

class Laz : public testing::TestWithParam<Packed> {};

TEST_P(Laz, EachFormatHoldsThePointsThatWereWritten) {
  const std::string name = GetParam().name, content = made(name);
  const std::string_view bytes = content;
  const size_t header = number<uint16_t>(bytes, 94), record = number<uint16_t>(bytes, header + 20);
  const LazPoints points(content, name, bytes.substr(header + 54, record),
                         {bytes[104] & 63, number<uint16_t>(bytes, 105), number<uint32_t>(bytes, 96), /*count=*/150});
  uint64_t hash = 0xcbf29ce484222325;
  size_t size = 0;
  for (size_t i = 0; i < points.chunks(); ++i)
    for (const char c : points.decode(i, 1000)) hash = (hash ^ uint8_t(c)) * 0x100000001b3, ++size;
  EXPECT_EQ(size, 150u * number<uint16_t>(bytes, 105));
  EXPECT_EQ(hash, GetParam().hash);
}

INSTANTIATE_TEST_SUITE_P(
    All, Laz,
    testing::Values(Packed{"format-0.laz", 0xe56b25cef7b0b32d}, Packed{"format-1.laz", 0x189d884044888029},
                    Packed{"format-2.laz", 0x226cdfd31959e411}, Packed{"format-3.laz", 0xe89fd879593690b5},
                    Packed{"format-6.laz", 0x55da919ca9ab4008}, Packed{"format-7.laz", 0xeb0d4e59de502e60},
                    Packed{"format-8.laz", 0x8d451868255f1b78}, Packed{"format-7-version-4.laz", 0xeb0d4e59de502e60}),
    [](const auto& info) {
      std::string name = info.param.name;
      std::replace_if(
          name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
      return name;
    });

TEST(LazFiles, AreReadAsLas) {
  const Mesh mesh = read_text("cloud", made("format-3.laz"), "gps_time");
  EXPECT_EQ(mesh.format, "LAZ 1.2 points (format 3)");
  ASSERT_EQ(points(mesh), 150u);
  expect_near(point(mesh, 1), {10.46, 47.11, 0.29}, 1e-9);
  EXPECT_EQ(array(mesh, "point_source_id").spans[0].hi, 907);
  EXPECT_EQ(mesh.scalars.size(), 600u);
}

TEST(LazFiles, APreviewHasPointsOfEachChunk) {
  const auto few = read_las(made("format-6.laz"), "few", nullptr, "", 6);
  ASSERT_TRUE(few.ok()) << few.error().text;
  EXPECT_EQ((*few)->vertices() / 4, 5u);  // every 25th of chunks of 60, 89 and 1 points; three are withheld
}

TEST(LazFiles, AreRefusedAtEveryLength) {
  for (const char* name : {"format-3.laz", "format-8.laz"}) {
    const std::string whole = made(name);
    for (size_t length = 1; length + 8 < whole.size(); length += 7) {
      const auto cloud = read_las(std::string_view(whole).substr(0, length), "cut.laz", nullptr);
      ASSERT_FALSE(cloud.ok()) << name << " at " << length;
      EXPECT_TRUE(cloud.error().text.starts_with("cut.laz: is ")) << cloud.error().text;
    }
  }
}

struct Change {
  size_t at;
  std::string bytes, says;
};

TEST(LazFiles, SayWhatIsNotRead) {
  const Change changes[] = {
      {kHeader + 54, raw(uint16_t{1}), "is LAZ of compressor 1, coder 0; compressors 2 and 3 with coder 0 are read"},
      {kItems + 4, raw(uint16_t{1}), "is LAZ with item 6 of version 1; version 2 is read"},
      {kItems + 6, raw(uint16_t{9}), "is LAZ with wave packets, which are not read"},
      {kItems + 6, raw(uint16_t{8}), "does not tell of points of format 3 with 37 bytes"},
      {kHeader + 18, raw(uint16_t{1}), "its record of LASzip has 0 bytes, 34 are needed"},
      {107, raw(uint32_t{4'000'000'000}), "it has 2 chunks, 40000000 are needed for 4000000000 points"},
      {107, raw(uint32_t{200}), "is truncated or damaged: 50 of the 100 points of chunk 1 can be decoded"}};
  for (const Change& change : changes) {
    std::string file = made("format-3.laz");
    const auto cloud = read_las(file.replace(change.at, change.bytes.size(), change.bytes), "bad.laz", nullptr);
    ASSERT_FALSE(cloud.ok()) << change.says;
    EXPECT_NE(cloud.error().text.find(change.says), std::string::npos) << cloud.error().text;
  }
}

// A folder of EPT: a page of nodes that names another one.
void write_ept(const TempFolder& folder, const std::string& type, const std::string& ending,
               const std::array<std::string, 3>& nodes) {
  for (const char* name : {"ept-hierarchy", "ept-data"}) std::filesystem::create_directory(folder / name);
  folder.write("ept.json", fmt::format(R"({{"dataType": "{}", "hierarchyType": "json", "points": 3, "schema": [
      {{"name": "X", "type": "signed", "size": 4, "scale": 0.5, "offset": 1000}},
      {{"name": "Intensity", "type": "unsigned", "size": 2}},
      {{"name": "Y", "type": "float", "size": 8}}, {{"name": "Z", "type": "float", "size": 4}}]}})",
                                       type));
  folder.write("ept-hierarchy/0-0-0-0.json", R"({"0-0-0-0": 1, "1-0-1-0": 1, "2-0-2-0": -1, "2-1-1-1": 0})");
  folder.write("ept-hierarchy/2-0-2-0.json", R"({"2-0-2-0": 1})");
  const char* names[] = {"0-0-0-0", "1-0-1-0", "2-0-2-0"};
  for (size_t i = 0; i < 3; ++i) folder.write(fmt::format("ept-data/{}.{}", names[i], ending), nodes[i]);
}

std::array<std::string, 3> ept_points() {
  std::array<std::string, 3> out;
  for (int i = 0; i < 3; ++i)
    out[size_t(i)] = raw(int32_t(4 * i - 2)) + raw(uint16_t(5 + i)) + raw(3e6 + i) + raw(float(i % 2));
  return out;
}

TEST(Ept, BinaryNodesAreReadByTheirSchema) {
  const TempFolder folder;
  write_ept(folder, "binary", "bin", ept_points());
  const Mesh mesh = read(find_mesh_file(folder / "")->path, "Intensity");
  EXPECT_EQ(mesh.format, "EPT points (binary)");
  ASSERT_EQ(points(mesh), 3u);
  for (size_t i = 0; i < 3; ++i) {
    expect_near(point(mesh, i), {999 + 2.0 * double(i), 3e6 + double(i), double(i % 2)}, 1e-6);
    EXPECT_EQ(mesh.scalars[4 * i], float(5 + i));
  }
  const auto files = companion_files(made_bytes(folder / "ept.json"), "ept", folder / "ept.json");
  EXPECT_EQ(files.size(), 5u);
  EXPECT_EQ(files.back(), folder / "ept-data/2-0-2-0.bin");
}

TEST(Ept, ZstandardNodesAreUnpacked) {
  std::array<std::string, 3> nodes = ept_points();
  for (size_t i = 0; i < nodes.size(); ++i) {  // a frame with its size, or a window in place of it; a block as it is
    const std::string& node = nodes[i];
    const std::string head = i == 0 ? "\x20"s + char(node.size()) : "\0\0"s;
    nodes[i] = "\x28\xb5\x2f\xfd" + head + char(1 | node.size() << 3) + "\0\0"s + node;
  }
  const TempFolder folder;
  write_ept(folder, "zstandard", "zst", nodes);
  const Mesh mesh = read(folder / "ept.json");
  ASSERT_EQ(points(mesh), 3u);
  expect_near(point(mesh, 2), {1003, 3000002, 0}, 1e-6);
}

TEST(Ept, NodesOfLaszipHaveTheirOwnHeaders) {
  const TempFolder folder;
  write_ept(folder, "laszip", "laz", {made("format-3.laz"), made("format-3.laz"), made("format-3.laz")});
  EXPECT_EQ(points(read(folder / "ept.json")), 450u);
  folder.write("ept-data/2-0-2-0.laz", made("format-2.laz"));
  const auto mixed = read_mesh(folder / "ept.json", nullptr);
  ASSERT_FALSE(mixed.ok());
  EXPECT_NE(mixed.error().text.find("points of ept-data/2-0-2-0.laz have other numbers"), std::string::npos);
}

TEST(Ept, SaysWhatIsWrong) {
  const auto refusal = [](const std::string& file, const std::string& content, const std::string& type = "binary") {
    const TempFolder folder;
    write_ept(folder, type, type.substr(0, 3), ept_points());
    if (!file.empty()) folder.write(file, content);
    const auto mesh = read_mesh(folder / "ept.json", nullptr);
    EXPECT_FALSE(mesh.ok()) << content;
    return mesh ? "" : mesh.error().text;
  };
  const auto says = [&](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says(refusal("", "", "tar"), "is EPT with points of type 'tar'; laszip, binary and zstandard are read");
  says(refusal("ept-hierarchy/2-0-2-0.json", "{\"../x\": 1}"), "2-0-2-0.json is damaged: '../x' is no node");
  says(refusal("ept-hierarchy/2-0-2-0.json", "["), "2-0-2-0.json is damaged");
  says(refusal("ept-data/1-0-1-0.bin", "short"), "is truncated: 5 bytes are no points of 18 bytes");
  const TempFolder folder;
  write_ept(folder, "binary", "bin", ept_points());
  std::filesystem::remove(folder / "ept-data/1-0-1-0.bin");
  says(read_mesh(folder / "ept.json", nullptr).error().text, "ept-data/1-0-1-0.bin");
}

TEST(E57, ScansHaveTheirPosesAndKindsOfCoordinates) {
  const Mesh mesh = read("tests/fuzz/corpus/e57/two-scans.e57", "intensity");
  EXPECT_EQ(mesh.format, "E57 points (2 scans)");
  ASSERT_EQ(points(mesh), 159u);
  EXPECT_NE(remarks(mesh).find("1 points are left out: the scanner measured none there"), std::string::npos);
  // Point 49 has x = 1 + (1000 - 4000) * 0.0005, y = 1, z = 2.04, and is turned by a quarter.
  expect_near(point(mesh, 49), {100 - 1, 200 - 0.5, 1.5 + 2.04}, 1e-6);
  EXPECT_EQ(mesh.colours[4 * 49], pack_rgb(98, 206, 7));
  EXPECT_EQ(mesh.scalars[4 * 49], 49);
  expect_near(point(mesh, 119 + 23),
              {10 * std::cos(0.1) * std::cos(-0.85), 10 * std::cos(0.1) * std::sin(-0.85), 10 * std::sin(0.1)}, 1e-6);
  EXPECT_EQ(mesh.colours[4 * 130], kNeutralAlbedo);
  EXPECT_EQ(array(mesh, "timeStamp").spans[0].lo, -double(uint64_t{1} << 40));
}

TEST(E57, DamageIsFoundByCheckSums) {
  const std::string whole = made_bytes("tests/fuzz/corpus/e57/two-scans.e57");
  for (size_t at = 60; at < whole.size(); at += 97) {
    std::string file = whole;
    file[at] = char(file[at] ^ 64);
    const auto cloud = read_e57(file, "bad.e57", nullptr);
    if (at < whole.size() - 1024) EXPECT_FALSE(cloud.ok()) << at;
  }
  for (size_t length = 1; length < whole.size(); length += 61)
    EXPECT_FALSE(read_e57(std::string_view(whole).substr(0, length), "cut.e57", nullptr).ok()) << length;
}

TEST(RealClouds, LazHoldsThePointsOfTheLas) {
  REAL_FILE(laz_path, "autzen_trim.laz");
  REAL_FILE(las_path, "autzen_trim_7.las");
  const Mesh laz = read(laz_path, "intensity"), las = read(las_path, "intensity");
  EXPECT_EQ(laz.format, "LAZ 1.2 points (format 3)");
  EXPECT_EQ(laz.positions, las.positions);
  EXPECT_EQ(laz.colours, las.colours);
  EXPECT_EQ(laz.scalars, las.scalars);
}

TEST(RealClouds, CopcAndEptHoldTheSamePoints) {
  REAL_FILE(copc_path, "lone-star.copc.laz");
  REAL_FILE(ept_path, "lone-star-ept/ept.json");
  const Mesh copc = read(copc_path), ept = read(ept_path);
  EXPECT_EQ(copc.format, "LAZ 1.4 points (format 6)");
  EXPECT_EQ(ept.format, "EPT points (laszip)");
  ASSERT_EQ(points(copc), 518862u);
  ASSERT_EQ(points(ept), 518862u);
  EXPECT_EQ(ept.coordinates.reference, "EPSG:26912 NAD83 / UTM zone 12N");
  for (const char* name : {"intensity", "gps_time", "point_source_id"})
    EXPECT_EQ(array(copc, name).spans[0].hi, array(ept, name).spans[0].hi) << name;
  glm::dvec3 sum(0);
  for (size_t i = 0; i < points(copc); ++i) sum += point(copc, i) - point(ept, i);
  expect_near(sum / 518862.0, glm::dvec3(0), 1e-4);
}

TEST(RealClouds, E57KeepsPlacesColoursAndPoses) {
  REAL_FILE(both_path, "A_B.e57");
  REAL_FILE(moved_path, "A4_moved.e57");
  const Mesh both = read(both_path), moved = read(moved_path);
  ASSERT_EQ(points(both), 6u);
  expect_near(point(both, 0), {-42.63949966430664, 1.8725999593734741, 0.666700005531311}, 1e-6);
  expect_near(point(both, 2), {-44.30009841918945, -1.132099986076355, 0.3357999920845032}, 1e-6);
  EXPECT_EQ(both.colours[0], pack_rgb(255, 255, 0));
  EXPECT_EQ(both.colours[8], pack_rgb(0, 255, 0));
  ASSERT_EQ(points(moved), 4u);
  expect_near(point(moved, 0), {-43.46733474731445, 0.9225031137466431, 0.3357999920845032}, 1e-5);
}

}  // namespace
}  // namespace telesplat::data::test
