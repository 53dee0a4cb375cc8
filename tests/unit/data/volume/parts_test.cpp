// Volumes with voxels in several files or behind other data, and values that differ only beyond 32-bit precision.
#include "services/data/kinds.h"
#include "tests/support/volume/files.h"

namespace telesplat::data::test {
namespace {

Result<Volume> read_step(const std::string& path, const std::string& spec = "") {
  const auto source = find_volume(path, {.raw = spec});
  if (!source) return source.error();
  return read_volume(*source, 0, nullptr);
}

class Parts : public testing::Test {
 protected:
  // Writes each slice into a file of its own, behind `before`.
  void write_slices(const std::string& pattern, int first, const std::string& before = "", bool zipped = false) {
    const std::string all = p.bytes<int16_t>();
    const size_t bytes = all.size() / 3;
    for (int k = 0; k < 3; ++k) {
      const std::string slice = all.substr(size_t(k) * bytes, bytes);
      folder.write(fmt::format(fmt::runtime(pattern), first + k), before + (zipped ? packed(slice) : slice));
    }
  }
  const TempFolder folder;
  const Pattern p{{5, 4, 3}, turned(), -20, 1};
  const std::string raw_little = "endian: little\nencoding: raw\n";
};

TEST_F(Parts, NrrdNamesAListOrAPatternOfFiles) {
  write_slices("s{:03d}.raw", 1);
  const std::string list = "s001.raw\ns002.raw\ns003.raw\n";
  for (const std::string& said :
       std::vector<std::string>{"LIST\n" + list, "LIST 2\n" + list, "s%03d.raw 1 3 1\n", "s%03d.raw 1 3 1 2\n",
                                "LIST\r\ns001.raw\r\ns002.raw\r\ns003.raw"})
    expect_same(read_or_fail(folder.write("a.nhdr", nrrd_header(p, "short", raw_little + "data file: " + said))), p);
  write_slices("t{}.raw", 9);
  expect_same(read_or_fail(folder.write("b.nhdr", nrrd_header(p, "short", raw_little + "data file: t%d.raw 9 11 1\n"))),
              p);
}

TEST_F(Parts, PackedOnesAndSkippedBeginningsAreOfEachFile) {
  write_slices("s{}.gz", 1, "", true);
  expect_same(read_or_fail(folder.write(
                  "a.nhdr", nrrd_header(p, "short", "endian: little\nencoding: gzip\ndata file: s%d.gz 1 3 1\n"))),
              p);
  write_slices("s{}.raw", 1, "two\nlines\n");
  expect_same(read_or_fail(folder.write(
                  "b.nhdr", nrrd_header(p, "short", raw_little + "data file: s%d.raw 1 3 1\nline skip: 2\n"))),
              p);
  write_slices("s{}.raw", 1, "a line\n1234");
  for (const char* skip : {"line skip: 1\nbyte skip: 4\n", "byte skip: -1\n", "byte skip: 11\n"})
    expect_same(read_or_fail(folder.write(
                    "c.nhdr", nrrd_header(p, "short", raw_little + skip + "data file: LIST\ns1.raw\ns2.raw\ns3.raw"))),
                p);
}

TEST_F(Parts, MetaImageNamesAListOrAPatternOfFiles) {
  write_slices("s{:03d}.raw", 1);
  const std::string binary = "BinaryData = True\nBinaryDataByteOrderMSB = False\nElementDataFile = ";
  for (const char* said : {"LIST\ns001.raw\ns002.raw\ns003.raw\n", "LIST 2\ns001.raw\ns002.raw\ns003.raw",
                           "s%03d.raw 1 3 1\n", "s%03d.raw 1 3 1 2\n"})
    expect_same(read_or_fail(folder.write("a.mhd", metaimage_header(p, "MET_SHORT", binary + said))), p);
}

TEST_F(Parts, OneThatIsMissingOrShortIsNamed) {
  write_slices("s{:03d}.raw", 1);
  const std::string path = folder.write("a.nhdr", nrrd_header(p, "short", raw_little + "data file: s%03d.raw 1 3 1\n"));
  folder.write("s003.raw", "short");
  auto v = read_step(path);
  ASSERT_FALSE(v);
  EXPECT_NE(v.error().text.find("5 bytes"), std::string::npos) << v.error().text;
  std::filesystem::remove(folder / "s002.raw");
  v = read_step(path);
  ASSERT_FALSE(v);
  EXPECT_NE(v.error().text.find("s002.raw"), std::string::npos) << v.error().text;
}

TEST_F(Parts, OutsideOfTheFolderAreRefusedToo) {
  std::filesystem::create_directories(folder / "data");
  write_slices("s{}.raw", 1);
  DataOptions o;
  o.scene = folder.write("data/a.nhdr",
                         nrrd_header(p, "short", raw_little + "data file: LIST\nown.raw\n../s2.raw\n../s3.raw\n"));
  folder.write("data/own.raw", p.bytes<int16_t>().substr(0, 40));
  const Status s = check_companions(o);
  ASSERT_FALSE(s);
  EXPECT_NE(s.error().text.find("s2.raw"), std::string::npos) << s.error().text;
}

TEST_F(Parts, ARawFileMayBeginWithSomethingElse) {
  Pattern q{{5, 4, 3}, glm::dmat4(1.0), -20, 1};
  const std::string path = folder.write("a.raw", std::string(512, 'h') + q.bytes<int16_t>());
  expect_same(read_or_fail(path, "5x4x3:i16:skip=512"), q);
  q.index_to_data[2][2] = 2;
  for (const char* spec : {"5x4x3:i16:1,1,2:skip=512", "5x4x3:i16:skip=512:1,1,2"})
    expect_same(read_or_fail(path, spec), q);
  for (const char* spec : {"5x4x3:i16:skip=511", "5x4x3:i16:skip=-1", "5x4x3:i16:skip=", "5x4x3:i16:skip=1e400"})
    EXPECT_FALSE(read_step(path, spec)) << spec;
}

TEST_F(Parts, AxisMinsAndMaxsAreSpacings) {
  const std::string head =
      "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nencoding: raw\naxis mins: 0 10 0\naxis maxs: 5 12 6\n";
  Pattern q{{5, 4, 3}, glm::dmat4(1.0), 1, 1};
  // Cells: edges, and the first sample half a step from its edge.
  q.index_to_data = glm::dmat4(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 0.5, 0, 0), glm::dvec4(0, 0, 2, 0),
                               glm::dvec4(0.5, 10.25, 1, 1));
  for (const char* centers : {"", "centers: cell cell cell\n"})
    expect_same(read_or_fail(folder.write("a.nrrd", head + centers + "\n" + q.bytes<uint8_t>())), q);
  q.index_to_data = glm::dmat4(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 2.0 / 3, 0, 0), glm::dvec4(0, 0, 3, 0),
                               glm::dvec4(0.5, 10, 0, 1));
  expect_same(read_or_fail(folder.write("b.nrrd", head + "centers: cell node node\n\n" + q.bytes<uint8_t>())), q);
}

TEST_F(Parts, SmallDifferencesOfLargeValuesAreKept) {
  for (const double middle : {1e9, -4e12, 101325.0, 1e300}) {
    const double step = std::max(1e-3, std::abs(middle) * 1e-12);
    const Pattern q{{5, 4, 3}, glm::dmat4(1.0), middle, step};
    const Volume v = read_or_fail(folder.write("a.raw", q.bytes<double>()), "5x4x3:f64");
    for (size_t at = 0; at < q.voxels(); ++at)
      ASSERT_NEAR(v.value(at), middle + step * double(at), step * 0.01) << middle << " " << at;
    EXPECT_NEAR(v.lo, middle, step * 0.01);
    EXPECT_NEAR(v.hi, middle + step * 59, step * 0.01);
  }
  const Pattern whole{{5, 4, 3}, glm::dmat4(1.0), 2'000'000'000, 1};
  const Volume v = read_or_fail(folder.write("b.raw", whole.bytes<int32_t>()), "5x4x3:i32");
  for (size_t at = 0; at < whole.voxels(); ++at) ASSERT_NEAR(v.value(at), 2e9 + double(at), 0.01);
}

}  // namespace
}  // namespace telesplat::data::test
