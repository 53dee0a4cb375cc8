// Every volume format, type, byte order and placement: read voxel by voxel as written.
#include "services/data/volume/store.h"
#include "tests/support/volume/files.h"

#include "services/data/inspect.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data::test {
namespace {

Pattern turned_pattern(bool mirror = false) { return {{5, 4, 3}, turned(mirror), -20, 1}; }

TEST(Nrrd, ReadsAllEncodingsAndByteOrders) {
  const TempFolder folder;
  const Pattern p = turned_pattern();
  for (const bool big : {false, true}) {
    const std::string endian = big ? "endian: big\n" : "endian: little\n";
    const std::string data = p.bytes<int16_t>(big);
    const std::string raw = folder.write("raw.nrrd", nrrd_header(p, "short", endian + "encoding: raw\n\n") + data);
    const std::string gzip =
        folder.write("gzip.nrrd", nrrd_header(p, "int16", endian + "encoding: gzip\n\n") + packed(data));
    for (const std::string& path : {raw, gzip}) {
      const Volume v = read_or_fail(path);
      expect_same(v, p);
      EXPECT_EQ(v.format, "nrrd");
      EXPECT_EQ(v.type, VoxelType::kI16);
      EXPECT_FALSE(v.hounsfield);
    }
  }
  expect_same(read_or_fail(folder.write("text.nrrd", nrrd_header(p, "int16", "encoding: text\n\n") + p.text())), p);
}

TEST(Nrrd, ReadsDetachedDataWithSkips) {
  const TempFolder folder;
  const Pattern p = turned_pattern(true);
  folder.write("a.raw", "12345" + p.bytes<float>());
  folder.write("a.raw.gz", packed("12345" + p.bytes<float>()));
  const std::string more = "endian: little\nencoding: raw\ndata file: a.raw\n";
  expect_same(read_or_fail(folder.write("a.nhdr", nrrd_header(p, "float", more + "byte skip: 5\n"))), p);
  expect_same(read_or_fail(folder.write("b.nhdr", nrrd_header(p, "float", more + "byte skip: -1\n"))), p);
  expect_same(
      read_or_fail(folder.write(
          "c.nhdr", nrrd_header(p, "float", "endian: little\nencoding: gz\ndatafile: a.raw.gz\nbyteskip: 5\n"))),
      p);
}

TEST(Nrrd, JoinsGzipMembers) {
  const TempFolder folder;
  const Pattern p = turned_pattern();
  const std::string data = p.bytes<int16_t>();
  expect_same(read_or_fail(folder.write("a.nrrd", nrrd_header(p, "int16", "endian: little\nencoding: gzip\n\n") +
                                                      packed(data.substr(0, 33)) + packed(data.substr(33)))),
              p);
}

TEST(Nrrd, SpacingsAloneAndLeftHandedSpaces) {
  const TempFolder folder;
  Pattern p{{3, 2, 2}, glm::dmat4(1.0), 1, 1};
  const std::string head = "NRRD0001\ntype: uchar\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n";
  p.index_to_data[0][0] = 0.5, p.index_to_data[2][2] = 4;
  expect_same(read_or_fail(folder.write("a.nrrd", head + "spacings: 0.5 nan 4\r\n\r\n" + p.bytes<uint8_t>())), p);
  // In left-anterior-superior, x grows to the left, unlike in a right-handed space with the other two axes.
  p.index_to_data[0][0] = -0.5, p.index_to_data[3][0] = -7;
  expect_same(
      read_or_fail(folder.write("b.nrrd", head +
                                              "space: left-anterior-superior\nspace directions: (0.5,0,0) (0,1,0) "
                                              "(0,0,4)\nspace origin: (7,0,0)\n\n" +
                                              p.bytes<uint8_t>())),
      p);
}

TEST(MetaImage, ReadsRawCompressedTextAndDetachedData) {
  const TempFolder folder;
  for (const bool mirror : {false, true}) {
    const Pattern p = turned_pattern(mirror);
    const std::string data = p.bytes<int16_t>(), zlib = packed(data, 15);
    const std::string binary = "BinaryData = True\nBinaryDataByteOrderMSB = False\n";
    std::vector<std::string> paths{
        folder.write("raw.mha", metaimage_header(p, "MET_SHORT", binary + "ElementDataFile = LOCAL\n") + data),
        folder.write("big.mha", metaimage_header(p, "MET_SHORT",
                                                 "BinaryData = True\nBinaryDataByteOrderMSB = True\nElementDataFile = "
                                                 "LOCAL\n") +
                                    p.bytes<int16_t>(true)),
        folder.write(
            "zlib.mha",
            metaimage_header(p, "MET_SHORT",
                             fmt::format("{}CompressedData = True\nCompressedDataSize = {}\nElementDataFile = LOCAL\n",
                                         binary, zlib.size())) +
                zlib)};
    folder.write("voxels.raw", data);
    paths.push_back(
        folder.write("detached.mhd", metaimage_header(p, "MET_SHORT", binary + "ElementDataFile = voxels.raw\n")));
    for (const std::string& path : paths) {
      SCOPED_TRACE(path);
      const Volume v = read_or_fail(path);
      expect_same(v, p);
      EXPECT_EQ(v.format, "metaimage");
      EXPECT_EQ(v.type, VoxelType::kI16);
    }
  }
}

struct TypeCase {
  const char *name, *nrrd, *meta, *vti;
  int nifti;
  VoxelType read_as;
};
const TypeCase kTypes[] = {{"u8", "uint8", "MET_UCHAR", "UInt8", 2, VoxelType::kU8},
                           {"i8", "int8", "MET_CHAR", "Int8", 256, VoxelType::kI8},
                           {"u16", "uint16", "MET_USHORT", "UInt16", 512, VoxelType::kU16},
                           {"i16", "int16", "MET_SHORT", "Int16", 4, VoxelType::kI16},
                           {"u32", "uint32", "MET_UINT", "UInt32", 768, VoxelType::kF32},
                           {"i32", "int32", "MET_INT", "Int32", 8, VoxelType::kF32},
                           {"u32", "uint32", "MET_ULONG", "UInt32", 768, VoxelType::kF32},
                           {"i32", "int32", "MET_LONG", "Int32", 8, VoxelType::kF32},
                           {"u64", "uint64", "MET_ULONG_LONG", "UInt64", 1280, VoxelType::kF32},
                           {"i64", "int64", "MET_LONG_LONG", "Int64", 1024, VoxelType::kF32},
                           {"f32", "float", "MET_FLOAT", "Float32", 16, VoxelType::kF32},
                           {"f64", "double", "MET_DOUBLE", "Float64", 64, VoxelType::kF32}};

std::string bytes_of(const Pattern& p, const std::string& type) {
  return type == "u8"    ? p.bytes<uint8_t>()
         : type == "i8"  ? p.bytes<int8_t>()
         : type == "u16" ? p.bytes<uint16_t>()
         : type == "i16" ? p.bytes<int16_t>()
         : type == "u32" ? p.bytes<uint32_t>()
         : type == "i32" ? p.bytes<int32_t>()
         : type == "u64" ? p.bytes<uint64_t>()
         : type == "i64" ? p.bytes<int64_t>()
         : type == "f32" ? p.bytes<float>()
                         : p.bytes<double>();
}

std::string vti(const Pattern& p, const std::string& type, const std::string& values, const std::string& more = "") {
  const glm::dmat4& m = p.index_to_data;
  const auto s = spacing_of(m);
  std::string turn;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) turn += fmt::format("{:.17g} ", m[c][r] / s[size_t(c)]);
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", p.size[0] - 1, p.size[1] - 1, p.size[2] - 1);
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt32\">\n<ImageData WholeExtent=\"{}\" Origin=\"{}\" Spacing=\"{:.17g} {:.17g} {:.17g}\" "
      "Direction=\"{}\">\n<Piece Extent=\"{}\">\n<PointData Scalars=\"v\">\n<DataArray type=\"{}\" Name=\"v\" {} "
      "format=\"ascii\">\n{}\n</DataArray>\n</PointData>\n</Piece>\n</ImageData>\n</VTKFile>\n",
      extent, three(m[3]), s[0], s[1], s[2], turn, extent, type, more, values);
}

TEST(Types, AllOfThemInAllFormats) {
  const TempFolder folder;
  for (const TypeCase& type : kTypes) {
    SCOPED_TRACE(type.name);
    const bool is_signed = type.name[0] != 'u';
    const Pattern p{{5, 4, 3}, turned(), is_signed ? -30.0 : 7.0, 1};
    const std::string data = bytes_of(p, type.name);
    const std::string one =
        folder.write("a.nrrd", nrrd_header(p, type.nrrd, "endian: little\nencoding: raw\n\n") + data);
    const std::string two = folder.write(
        "a.mha",
        metaimage_header(p, type.meta, "BinaryData = True\nBinaryDataByteOrderMSB = False\nElementDataFile = LOCAL\n") +
            data);
    const std::string three =
        folder.write("a.nii", nifti_header(p, {.type = type.nifti, .bits = int(8 * data.size() / p.voxels())}) + data);
    const std::string four = folder.write("a.vti", vti(p, type.vti, p.text()));
    for (const std::string& path : {one, two, three, four}) {
      SCOPED_TRACE(path);
      const Volume v = read_or_fail(path);
      EXPECT_EQ(v.type, type.read_as);
      expect_same(v, p);
    }
  }
}

TEST(Nifti, ReadsBothVersionsAndByteOrdersPackedOrNot) {
  const TempFolder folder;
  const Pattern p = turned_pattern(true);
  for (const int version : {1, 2})
    for (const bool big : {false, true}) {
      SCOPED_TRACE(fmt::format("version {}, {} endian", version, big ? "big" : "little"));
      const std::string file = nifti_header(p, {.version = version, .big_endian = big}) + p.bytes<int16_t>(big);
      expect_same(read_or_fail(folder.write("a.nii", file)), p);
      const Volume v = read_or_fail(folder.write("b.nii.gz", packed(file)));
      expect_same(v, p);
      EXPECT_EQ(v.format, "nifti");
    }
}

TEST(Nifti, ReadsPairs) {
  const TempFolder folder;
  const Pattern p = turned_pattern();
  folder.write("a.img", p.bytes<int16_t>());
  const std::string header = folder.write("a.hdr", nifti_header(p, {.pair = true}).substr(0, 348));
  expect_same(read_or_fail(header), p);
}

TEST(Nifti, QformTurnsAndMayMirror) {
  const TempFolder folder;
  // Half a turn about z and a quarter about x, as quaternion (a, b, c, d) = (0, 0, s, s): x to -x, y to z, z to y.
  const double s = std::sqrt(0.5);
  for (const double qfac : {1.0, -1.0}) {
    SCOPED_TRACE(qfac);
    Pattern p{{5, 4, 3}, glm::dmat4(0.0), -9, 1};
    p.index_to_data[0] = {-0.5, 0, 0, 0};
    p.index_to_data[1] = {0, 0, 0.75, 0};
    p.index_to_data[2] = {0, 2 * qfac, 0, 0};
    p.index_to_data[3] = {3, -4, 5, 1};
    Nifti n{.sform = false, .qform = true, .quaternion = {0, s, s}, .qfac = qfac};
    expect_same(read_or_fail(folder.write("a.nii", nifti_header(p, n) + p.bytes<int16_t>())), p);
    n.sform = true;  // the same placement; VTK turns slices round all the same
    expect_same(read_or_fail(folder.write("b.nii", nifti_header(p, n) + p.bytes<int16_t>())), p);
  }
}

TEST(Nifti, ScalesAndPlacesBySpacingAlone) {
  const TempFolder folder;
  Pattern p{{5, 4, 3}, glm::dmat4(1.0), 0, 1};
  p.index_to_data[0][0] = 0.5, p.index_to_data[1][1] = 0.25;
  const Nifti n{.type = 2, .bits = 8, .sform = false, .slope = -2, .intercept = 10};
  const Volume v = read_or_fail(folder.write("a.nii", nifti_header(p, n) + p.bytes<uint8_t>()));
  expect_same(v, p, -2, 10);
  EXPECT_EQ(v.scale, -2);
  EXPECT_EQ(v.offset, 10);
}

TEST(Vti, ReadsExtentsThatBeginElsewhereAndCells) {
  const TempFolder folder;
  Pattern p{{4, 3, 2}, glm::dmat4(1.0), 1, 1};
  std::string text;
  for (size_t at = 0; at < p.voxels(); ++at) text += fmt::format("{} ", 1 + at);
  const auto file = [&](const char* extent, const char* kind) {
    return fmt::format(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<ImageData "
        "WholeExtent=\"{}\" Origin=\"1 2 3\" Spacing=\"2 1 1\">\n<Piece Extent=\"{}\">\n<{} Scalars=\"a\">\n<DataArray "
        "type=\"UInt16\" Name=\"a\" format=\"ascii\">{}</DataArray>\n</{}>\n</Piece>\n</ImageData>\n</VTKFile>\n",
        extent, extent, kind, text, kind);
  };
  p.index_to_data = glm::dmat4(1.0);
  p.index_to_data[0][0] = 2;
  p.index_to_data[3] = {1 + 2 * 10, 2 - 1, 3, 1};
  const Volume points = read_or_fail(folder.write("points.vti", file("10 13 -1 1 0 1", "PointData")));
  expect_same(points, p);
  EXPECT_EQ(points.format, "vti");
  p.index_to_data[3] += glm::dvec4(1, 0.5, 0.5, 0);  // centres of cells
  expect_same(read_or_fail(folder.write("cells.vti", file("10 14 -1 2 0 2", "CellData"))), p);
}

// Plain types are little-endian; "be" swaps their bytes.
TEST(Raw, HasEveryTypeInEitherByteOrder) {
  const auto check = [&]<class T>(T, const std::string& type) {
    const TempFolder folder;
    const Pattern p{{3, 2, 2}, glm::dmat4(1.0), 5, 3};
    const std::string little = p.bytes<T>(), big = p.bytes<T>(true);
    EXPECT_TRUE(sizeof(T) == 1 || little != big);
    expect_same(read_or_fail(folder.write("little.raw", little), "3x2x2:" + type), p);
    expect_same(read_or_fail(folder.write("big.raw", big), "3x2x2:" + type + "be"), p);
  };
  check(uint8_t{}, "u8"), check(int8_t{}, "i8"), check(uint16_t{}, "u16"), check(int16_t{}, "i16");
  check(uint32_t{}, "u32"), check(int32_t{}, "i32"), check(uint64_t{}, "u64"), check(int64_t{}, "i64");
  check(float{}, "f32"), check(double{}, "f64");
}

TEST(Raw, GuessesAreAsLargeAsTheFile) {
  EXPECT_EQ(raw_guesses("/data/tooth_103x94x161_uint16.raw", 3117604), std::vector<std::string>{"103x94x161:u16"});
  EXPECT_EQ(raw_guesses("a-2x3x4.raw", 24 * 4), std::vector<std::string>{"2x3x4:f32"});
  EXPECT_EQ(raw_guesses("foot.raw", 256 * 256 * 256)[0], "256x256x256:u8");
  EXPECT_TRUE(raw_guesses("tooth_103x94x161_uint16.raw", 3117605).empty()) << "not that many bytes";
  EXPECT_TRUE(raw_guesses("99999x99999x99999x1_4096x4096x99999.raw", 7).empty());
  const TempFolder folder;
  for (const uint64_t bytes : {1ull << 24, 512ull * 512 * 300 * 2, 100ull * 100 * 100 * 4, 64ull * 64 * 64 * 2})
    for (const std::string& guess : raw_guesses("a.raw", bytes)) {
      const auto header = parse_raw_spec(guess, "a.raw");
      ASSERT_TRUE(header.ok()) << guess;
      EXPECT_EQ(header->voxel_bytes(), bytes) << guess;
    }
}

TEST(Raw, ReadsWhatItIsTold) {
  const TempFolder folder;
  Pattern p{{5, 4, 3}, glm::dmat4(1.0), -20, 1};
  const std::string path = folder.write("a.raw", p.bytes<int16_t>(true));
  expect_same(read_or_fail(path, "5x4x3:i16be"), p);
  p.index_to_data[0][0] = 0.5, p.index_to_data[2][2] = 2.5;
  const Volume v = read_or_fail(path, "5x4x3:i16be:0.5,1,2.5");
  expect_same(v, p);
  EXPECT_EQ(v.format, "raw");
  expect_same(read_or_fail(folder.write("b.raw", p.bytes<float>()), "5x4x3:f32:0.5,1,2.5"), p);
  expect_same(read_or_fail(folder.write("c.raw", p.bytes<int8_t>()), "5x4x3:i8:0.5,1,2.5"), p);
}

class DicomFolder : public testing::TestWithParam<DicomWriter::Syntax> {};

TEST_P(DicomFolder, IsSortedByPositionAndPlaced) {
  const TempFolder folder;
  const Pattern p = turned_pattern();
  const Dicom d{.syntax = GetParam(), .modality = "CT", .slope = "2", .intercept = "-1024", .bits_stored = 12};
  // Names in another order than positions, and another file beside them.
  const char* names[] = {"b", "c", "a"};
  for (int k = 0; k < 3; ++k) folder.write(names[k], dicom_slice(p, k, d));
  folder.write("README.txt", "slices");
  const std::string path = folder / "";
  EXPECT_TRUE(looks_like_volume(path));
  const Volume v = read_or_fail(path);
  expect_same(v, p, 2, -1024);
  EXPECT_EQ(v.format, "dicom");
  EXPECT_EQ(v.type, VoxelType::kI16);
  EXPECT_TRUE(v.hounsfield);
  EXPECT_EQ(v.remark, "");
}

INSTANTIATE_TEST_SUITE_P(Syntaxes, DicomFolder,
                         testing::Values(DicomWriter::Syntax::kExplicit, DicomWriter::Syntax::kImplicit,
                                         DicomWriter::Syntax::kBigEndian));

TEST(DicomSeries, TakesTheLongestOfSeveralAndSaysSo) {
  const TempFolder folder;
  const Pattern p = turned_pattern();
  for (int k = 0; k < 3; ++k) folder.write(fmt::format("{}.dcm", k), dicom_slice(p, k, {}));
  folder.write("localizer.dcm", dicom_slice({{9, 9, 1}, turned(), 0, 1}, 0, {.series = "1.2.4"}));
  const Volume v = read_or_fail(folder / "");
  expect_same(v, p);
  EXPECT_NE(v.remark.find("holds 2 series"), std::string::npos) << v.remark;
}

TEST(DicomSeries, TakesTheOneThatIsAskedFor) {
  const TempFolder folder;
  const Pattern p = turned_pattern(), other{{4, 3, 2}, turned(), 7, 1};
  for (int k = 0; k < 3; ++k) folder.write(fmt::format("{}.dcm", k), dicom_slice(p, k, {}));
  for (int k = 0; k < 2; ++k) folder.write(fmt::format("b{}.dcm", k), dicom_slice(other, k, {.series = "1.2.4"}));
  for (const char* which : {"2", "1.2.4"}) {
    const auto source = find_volume(folder / "", {.series = which});
    ASSERT_TRUE(source.ok()) << source.error().text;
    const auto volume = read_volume(*source, 0, nullptr);
    ASSERT_TRUE(volume.ok()) << volume.error().text;
    expect_same(*volume, other);
    EXPECT_NE(volume->remark.find("1: MR, 3 slices of 5 x 4; 2: MR, 2 slices of 4 x 3"), std::string::npos)
        << volume->remark;
  }
  const auto refused = find_volume(folder / "", {.series = "3"});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("--series \"3\": there is none"), std::string::npos) << refused.error().text;
  EXPECT_FALSE(find_volume(folder / "0.dcm", {.series = "1"}).ok()) << "a series of a single file";
}

TEST(DicomSeries, GoesByNumberWithoutPositionsAndRescalesEachSlice) {
  const TempFolder folder;
  Pattern p{{5, 4, 3}, glm::dmat4(1.0), 0, 1};
  p.index_to_data[2][2] = 3;
  for (int k = 0; k < 3; ++k)
    folder.write(fmt::format("{}.dcm", 9 - k), dicom_slice(p, k, {.slope = "0.5", .positions = false}));
  expect_same(read_or_fail(folder / ""), p, 0.5, 0);
  // One slice has another slope: values become f32.
  folder.write("9.dcm", dicom_slice(p, 0, {.slope = "0.25", .positions = false}));
  const Volume v = read_or_fail(folder / "");
  EXPECT_EQ(v.type, VoxelType::kF32);
  EXPECT_EQ(v.value(3), 0.75);
  EXPECT_EQ(v.value(20), 10);
}

TEST(Series, GoesByNumberNotByName) {
  const TempFolder folder;
  const auto write = [&](const std::string& name, double first) {
    const Pattern p{{2, 2, 2}, glm::dmat4(1.0), first, 1};
    folder.write(name, nrrd_header(p, "uint8", "encoding: raw\n\n") + p.bytes<uint8_t>());
  };
  write("run2-phase9.nrrd", 9), write("run2-phase10.nrrd", 10), write("run2-phase100.nrrd", 100);
  folder.write("notes.txt", "what this is");
  const auto source = find_volume(folder / "");
  ASSERT_TRUE(source.ok()) << source.error().text;
  ASSERT_EQ(source->steps.size(), 3u);
  EXPECT_TRUE(check_steps(*source).ok());
  const double firsts[] = {9, 10, 100};
  for (size_t s = 0; s < 3; ++s) EXPECT_EQ(read_or_fail(folder / "", "", s).value(0), firsts[s]);
}

TEST(Series, GoesByTheNumberThatDiffers) {
  const auto order = [](const std::vector<std::string>& names) {
    const TempFolder folder;
    for (const std::string& name : names)
      folder.write(name, nrrd_header({{1, 1, 1}, glm::dmat4(1.0), 0, 1}, "uint8", "encoding: raw\n\n") + "a");
    const auto source = find_volume(folder / "");
    std::string out;
    if (!source) return source.error().text;
    for (const std::string& step : source->steps) out += step.substr((folder / "").size()) + " ";
    return out;
  };
  EXPECT_EQ(order({"case42_t10_v2.nrrd", "case42_t9_v2.nrrd"}), "case42_t9_v2.nrrd case42_t10_v2.nrrd ");
  EXPECT_EQ(order({"t0.5.nrrd", "t0.25.nrrd", "t10.125.nrrd", "t9.75.nrrd"}),
            "t0.25.nrrd t0.5.nrrd t9.75.nrrd t10.125.nrrd ");
  EXPECT_EQ(order({"step2_time0.5.nrrd", "step10_time2.5.nrrd"}), "step2_time0.5.nrrd step10_time2.5.nrrd ");
  for (const auto& names : {std::vector<std::string>{"p1_t1.nrrd", "p1_t2.nrrd", "p2_t1.nrrd"},
                            {"a1_b2.nrrd", "a2_b1.nrrd"},
                            {"liver1.nrrd", "spleen2.nrrd"}})
    EXPECT_NE(order(names).find("are not one numbered series"), std::string::npos) << order(names);
  EXPECT_NE(order({"t1.nrrd", "t01.nrrd"}).find("the same number"), std::string::npos);
}

TEST(Series, OfRawFiles) {
  const TempFolder folder;
  for (int s = 0; s < 3; ++s)
    folder.write(fmt::format("t{:02}.raw", s), Pattern{{2, 2, 2}, glm::dmat4(1.0), s * 10.0, 1}.bytes<uint8_t>());
  EXPECT_EQ(read_or_fail(folder / "", "2x2x2:u8", 2).value(7), 27);
}

TEST(PatientSpace, IsOneForFilesInLpsAndInRas) {
  const TempFolder folder;
  const Pattern lps = turned_pattern();
  Pattern ras = lps;
  ras.index_to_data = glm::dmat4({-1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}) * lps.index_to_data;
  folder.write("a.nrrd", nrrd_header(lps, "int16", "endian: little\nencoding: raw\n\n") + lps.bytes<int16_t>());
  folder.write("a.nii", nifti_header(ras, {}) + ras.bytes<int16_t>());
  for (const std::string up : {"auto", "z", "-z"}) {
    const auto open = [&](const std::string& name) {
      auto store = VolumeStore::open(folder / name, {}, {.up = up}, [](const char*, double) {});
      EXPECT_TRUE(store.ok()) << store.error().text;
      return store ? (*store)->session().grid.index_to_room : glm::dmat4(0.0);
    };
    const glm::dmat4 a = open("a.nrrd"), b = open("a.nii");
    for (int c = 0; c < 4; ++c) EXPECT_LT(glm::distance(a[c], b[c]), 1e-6) << up << " " << c;
  }
}

TEST(Values, NotFiniteOnesCountAsTheLowest) {
  const TempFolder folder;
  const std::string path = folder.write("a.raw", raw(NAN) + raw(-3.0f) + raw(INFINITY) + raw(5.0f));
  const Volume v = read_or_fail(path, "2x2x1:f32");
  EXPECT_EQ(v.lo, -3);
  EXPECT_EQ(v.hi, 5);
  EXPECT_EQ(v.not_finite, 2u);
  EXPECT_EQ(v.value(0), -3);
  EXPECT_EQ(v.value(2), -3);
  EXPECT_EQ(v.value(3), 5);
}

TEST(Values, HounsfieldIsGuessedFromIntegersOnBothSides) {
  const TempFolder folder;
  const auto hounsfield = [&](int16_t lo, int16_t hi) {
    return read_or_fail(folder.write("a.raw", raw(lo) + raw(hi)), "2x1x1:i16").hounsfield;
  };
  EXPECT_TRUE(hounsfield(-1000, 1500));
  EXPECT_FALSE(hounsfield(-100, 1500));
  EXPECT_FALSE(hounsfield(0, 3000));
}

TEST(Inspect, SaysWhatTheVolumeIs) {
  const TempFolder folder;
  const Pattern p = turned_pattern(true);
  const std::string path =
      folder.write("a.nrrd", nrrd_header(p, "int16", "endian: little\nencoding: raw\n\n") + p.bytes<int16_t>());
  const auto facts = inspect_volume(path, {}, {}, nullptr);
  ASSERT_TRUE(facts.ok()) << facts.error().text;
  uint64_t counted = 0;
  for (const uint64_t n : facts->histogram) counted += n;
  EXPECT_EQ(counted, p.voxels());
  const std::string text = describe(*facts).table();
  for (const char* part : {"nrrd", "5 x 4 x 3 of i16", "0.5 x 0.75 x 2", "left-handed", "-20 .. 39"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
}

}  // namespace
}  // namespace telesplat::data::test
