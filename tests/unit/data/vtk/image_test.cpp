// Images of VTK as volumes.
#include "services/data/volume/formats/header.h"
#include "services/data/volume/volume.h"
#include "tests/unit/data/vtk/vtk_files.h"

namespace telesplat::data::test {
namespace {

Volume volume_or_fail(const std::string& path, const std::string& array = {}) {
  EXPECT_TRUE(looks_like_volume(path));
  auto source = find_volume(path);
  EXPECT_TRUE(source.ok()) << (source ? "" : source.error().text);
  if (!source) return {};
  source->layout.array = array;
  auto volume = read_volume(*source, 0, nullptr);
  EXPECT_TRUE(volume.ok()) << (volume ? "" : volume.error().text);
  return volume ? std::move(*volume) : Volume();
}

// Points from (first, 0, 0) to (last, 1, 1); each value is 100 times its x, plus y and z.
std::string piece(int first, int last, VtkWriter& writer, const std::string& more = "") {
  std::vector<int16_t> values;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = first; i <= last; ++i) values.push_back(int16_t(100 * i + 10 * j + k));
  return fmt::format("<Piece Extent='{} {} 0 1 0 1'><PointData Scalars='ct'>{}{}</PointData></Piece>", first, last,
                     more, writer.array("Int16", "Name=\"ct\"", values));
}
std::string image(const std::string& pieces, const VtkWriter& writer, const std::string& extent = "0 4 0 1 0 1") {
  return writer.file(
      "ImageData",
      fmt::format("<ImageData WholeExtent='{}' Origin='1 2 3' Spacing='2 1 1'>{}</ImageData>\n", extent, pieces));
}
void expect_ramp(const Volume& v, int first = 0, int last = 4) {
  ASSERT_EQ(v.size, (std::array<int, 3>{last - first + 1, 2, 2}));
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = first; i <= last; ++i)
        EXPECT_EQ(v.value(size_t(i - first + v.size[0] * (j + 2 * k))), 100 * i + 10 * j + k);
  EXPECT_EQ(v.index_to_data[0], glm::dvec4(2, 0, 0, 0));
  EXPECT_EQ(v.index_to_data[3], glm::dvec4(1 + 2 * first, 2, 3, 1));
}

TEST(VtkImage, ReadsEveryEncoding) {
  const TempFolder folder;
  using Mode = VtkEncoding::Mode;
  for (const Mode mode : {Mode::kAscii, Mode::kBase64, Mode::kAppendedRaw, Mode::kAppendedBase64})
    for (const char* packing : {"", "ZLib", "LZ4", "LZMA"}) {
      SCOPED_TRACE(fmt::format("{} {}", int(mode), packing));
      VtkWriter writer({mode, packing, false, true});
      const std::string content = piece(0, 4, writer);
      expect_ramp(volume_or_fail(folder.write("a.vti", image(content, writer))));
    }
}

TEST(VtkImage, PiecesInOneFileAndInSeveral) {
  const TempFolder folder;
  VtkWriter writer;
  const std::string left = piece(0, 2, writer), right = piece(2, 4, writer);
  expect_ramp(volume_or_fail(folder.write("a.vti", image(left + right, writer))));
  const auto missing = find_volume(folder.write("cut.vti", image(left, writer)));
  ASSERT_TRUE(missing);
  const auto cut = read_volume(*missing, 0, nullptr);
  ASSERT_FALSE(cut);
  EXPECT_NE(cut.error().text.find("has 12 values for 5 x 2 x 2 voxels"), std::string::npos) << cut.error().text;
  folder.write("l.vti", image(left, writer, "0 2 0 1 0 1"));
  folder.write("r.vti", image(right, writer, "2 4 0 1 0 1"));
  expect_ramp(volume_or_fail(folder.write(
      "a.pvti",
      writer.file("PImageData",
                  "<PImageData WholeExtent='0 4 0 1 0 1' Origin='1 2 3' Spacing='2 1 1'><PPointData Scalars='ct'>"
                  "<PDataArray type='Int16' Name='ct'/></PPointData><Piece Source='l.vti'/><Piece Source='r.vti'/>"
                  "</PImageData>"))));
}

TEST(VtkImage, OneOfSeveralArraysIsChosenByNameOrMark) {
  const TempFolder folder;
  VtkWriter writer;
  const std::string others = writer.array("Float32", "Name='wind' NumberOfComponents='3'", std::vector<float>(60, 1)) +
                             writer.array("Float32", "Name='heat'", std::vector<float>(20, 7));
  const std::string path = folder.write("a.vti", image(piece(0, 4, writer, others), writer));
  const auto header = read_volume_header(path, "");
  ASSERT_TRUE(header) << header.error().text;
  EXPECT_EQ(header->array, "ct") << "the active scalars";
  EXPECT_EQ(header->arrays, (std::vector<std::string>{"wind", "heat", "ct"}));
  expect_ramp(volume_or_fail(path));
  const Volume heat = volume_or_fail(path, "heat");
  EXPECT_EQ(heat.array, "heat");
  EXPECT_EQ(heat.hi, 7);
  const auto unknown = read_volume_header(path, "", "cold");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().text.find("no array \"cold\"; it has: wind, heat, ct"), std::string::npos);
}

TEST(VtkImage, LegacyStructuredPoints) {
  const TempFolder folder;
  const std::string head =
      "# vtk DataFile Version 3.0\nx\n{}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 2 2\nORIGIN 1 2 3\n"
      "SPACING 2 1 1\nPOINT_DATA 20\nSCALARS other short 1\nLOOKUP_TABLE default\n{}\n"
      "SCALARS ct short 1\nLOOKUP_TABLE default\n{}\n";
  std::string text, bytes, zeros, no_bytes;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 5; ++i) {
        text += fmt::format("{} ", 100 * i + 10 * j + k), zeros += "0 ";
        bytes += raw(int16_t(100 * i + 10 * j + k), true), no_bytes += std::string(2, '\0');
      }
  const std::string words = fmt::format(fmt::runtime(head), "ASCII", zeros, text),
                    binary = fmt::format(fmt::runtime(head), "BINARY", no_bytes, bytes);
  expect_ramp(volume_or_fail(folder.write("a.vtk", words), "ct"));
  expect_ramp(volume_or_fail(folder.write("b.vtk", binary), "ct"));
  EXPECT_EQ(volume_or_fail(folder / "b.vtk").array, "other") << "the first scalars are active";
  EXPECT_EQ(volume_or_fail(folder / "b.vtk").format, "vtk");
}

}  // namespace
}  // namespace telesplat::data::test
