// A bad volume file gives one clear line that names it; no crash, no hang, no memory by a file's claims.
#include <sys/resource.h>

#include "services/data/volume/formats/import_stream.h"
#include "tests/support/volume/files.h"

#include <unistd.h>

namespace telesplat::data::test {
namespace {

using namespace std::string_literals;

long peak_rss_kb() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

#ifdef TELESPLAT_SANITIZED
constexpr long kMostTaken_kb = 256 * 1024;  // with the memory's shadow, and freed memory that is held back
#else
constexpr long kMostTaken_kb = 64 * 1024;
#endif

// Reads a file that must be refused. Returns the error's text, after checking the properties of every such text.
std::string refusal(const std::string& path, const std::string& spec = "", const std::string& named = "") {
  const long before_kb = peak_rss_kb();
  const auto source = find_volume(path, {.raw = spec});
  std::string text;
  if (!source) {
    text = source.error().text;
  } else {
    const auto volume = read_volume(*source, 0, nullptr);
    EXPECT_FALSE(volume.ok()) << path << " was accepted";
    if (volume) return "";
    text = volume.error().text;
  }
  EXPECT_TRUE(text.starts_with(named.empty() ? path : named)) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  EXPECT_LT(text.size(), 2 * path.size() + 400) << text;
  EXPECT_LT(peak_rss_kb() - before_kb, kMostTaken_kb) << "memory was taken by a claimed size: " << text;
  return text;
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

const Pattern kPattern{{5, 4, 3}, turned(), -20, 1};
const std::string kLittle = "endian: little\n", kRaw = kLittle + "encoding: raw\n\n",
                  kGzip = kLittle + "encoding: gzip\n\n";
const std::string kBinary = "BinaryData = True\nBinaryDataByteOrderMSB = False\n";

struct BadFile {
  std::string name, content, says;
};
class BadVolume : public testing::TestWithParam<BadFile> {};

TEST_P(BadVolume, IsRefusedWithALineThatSaysWhy) {
  const TempFolder folder;
  const std::string path = folder.write(GetParam().name, GetParam().content);
  EXPECT_TRUE(looks_like_volume(path));
  EXPECT_SAYS(refusal(path), GetParam().says);
}

std::string nrrd(const std::string& fields, const std::string& data = "") {
  return "NRRD0004\n" + fields + "\n" + data;
}
std::string with(const std::string& type, const std::string& sizes, const std::string& more,
                 const std::string& data = "") {
  const size_t axes = size_t(std::count(sizes.begin(), sizes.end(), ' ')) + 1;
  return nrrd(fmt::format("type: {}\ndimension: {}\nsizes: {}\n{}", type, axes, sizes, more), data);
}

INSTANTIATE_TEST_SUITE_P(
    Nrrd, BadVolume,
    testing::Values(
        BadFile{"a.nrrd", "NRRD0009\n\n", "version"}, BadFile{"a.nrrd", "nothing", "NRRD000"},
        BadFile{"a.nrrd", nrrd("type: uint8\n"), "sizes"}, BadFile{"a.nrrd", nrrd("type: block\n"), "block"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: raw\n", std::string(59, 'x')), "59 bytes"},
        BadFile{"a.nrrd", with("uint8", "4096 4096 1000", "encoding: raw\n", "x"), "16777216000 bytes"},
        BadFile{"a.nrrd", with("uint8", "4096 4096 1000", "encoding: gzip\n", packed("x")), "compressed"},
        BadFile{"a.nrrd", with("uint8", "4097 1 1", "encoding: raw\n", std::string(5000, 'x')), "4096"},
        BadFile{"a.nrrd", with("uint8", "0 4 3", "encoding: raw\n", "x"), "0 x 4 x 3"},
        BadFile{"a.nrrd", with("uint8", "-5 4 3", "encoding: raw\n", "x"), "sizes"},
        BadFile{"a.nrrd", with("uint8", "9e15 9e15 9e15", "encoding: raw\n", "x"), "4096"},
        BadFile{"a.nrrd", with("uint8", "9e99 1 1", "encoding: raw\n", "x"), "sizes"},
        BadFile{"a.nrrd", with("uint8", "3 5 4 3", "encoding: raw\n", std::string(180, 'x')), "4 axes"},
        BadFile{"a.nrrd", with("uint8", "5 4", "encoding: raw\n", std::string(20, 'x')), "2 axes"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: bzip2\n", "x"), "bzip2"},
        BadFile{"a.nrrd", with("uint16", "5 4 3", "encoding: raw\n", std::string(120, 'x')), "endian"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: raw\nspacings: 1 0 1\n", std::string(60, 'x')), "flat"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: raw\nspacings: 1 1\n", std::string(60, 'x')), "spacings"},
        BadFile{
            "a.nrrd",
            with("uint8", "5 4 3", "encoding: raw\nspace directions: (1,0,0) (2,0,0) (0,0,1)\n", std::string(60, 'x')),
            "flat"},
        BadFile{"a.nrrd",
                with("uint8", "5 4 3", "encoding: raw\nspace directions: (1,0,0) (nan,0,0) (0,0,1)\n",
                     std::string(60, 'x')),
                "nan"},
        BadFile{
            "a.nrrd",
            with("uint8", "5 4 3", "encoding: raw\nspace directions: (1,0) (0,1,0) (0,0,1)\n", std::string(60, 'x')),
            "directions"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: raw\nspace origin: here\n", std::string(60, 'x')),
                "origin"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: raw\nbyte skip: 1e18\n", std::string(60, 'x')), "skips"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: raw\nline skip: -2\n\n", std::string(60, 'x')), "skips"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: text\n", std::string(200, '1')), "no number"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: text\n", std::string(200, '\n') + "7 8 9"),
                "ends too early"},
        BadFile{"a.nrrd", with("uint8", "2 1 1", "encoding: text\n", "300 1"), "300"},
        BadFile{"a.nrrd", with("uint8", "5 4 3", "encoding: gzip\n", "no gzip stream"), "damaged"},
        BadFile{"a.nrrd", with("float", "2 1 1", kLittle + "encoding: raw\n", raw(NAN) + raw(NAN)), "finite"},
        BadFile{"a.nrrd", with("double", "2 1 1", kLittle + "encoding: raw\n", raw(-1.5e308) + raw(1.5e308)),
                "more than a number"},
        BadFile{"a.nhdr", with("uint8", "5 4 3", "encoding: raw\ndata file: gone.raw\n"), "gone.raw"},
        BadFile{"a.nhdr", with("uint8", "5 4 3", "encoding: raw\ndata file: LIST\na.raw\n"), "missing"},
        BadFile{"a.nhdr", with("uint8", "5 4 3", "encoding: raw\ndata file: s%03f.raw 1 3 1\n"), "pattern"},
        BadFile{"a.nhdr", with("uint8", "5 4 3", "encoding: raw\ndata file: %d.raw 1 1000000000 1\n"), "pattern"},
        BadFile{"a.nhdr", with("uint8", "5 4 3", "encoding: raw\ndata file: %d.raw 1 7 1\n"), "lie in 7 files"},
        BadFile{"a.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n", "does not end"}));

std::string meta(const std::string& fields, const std::string& data = "") {
  return "ObjectType = Image\nNDims = 3\n" + kBinary + fields + "ElementDataFile = LOCAL\n" + data;
}
INSTANTIATE_TEST_SUITE_P(
    MetaImage, BadVolume,
    testing::Values(
        BadFile{"a.mha", "ObjectType = Image\n", "no end"}, BadFile{"a.mha", "what is this\n", "without"},
        BadFile{"a.mha", meta("DimSize = 5 4 3\nElementType = MET_UCHAR\n", std::string(59, 'x')), "59 bytes"},
        BadFile{"a.mha", meta("DimSize = 4000 4000 1000\nElementType = MET_DOUBLE\n", "x"), "128000000000 bytes"},
        BadFile{"a.mha", meta("DimSize = 5 4\nElementType = MET_UCHAR\n", "x"), "DimSize"},
        BadFile{"a.mha", meta("DimSize = 5 4 4097\nElementType = MET_UCHAR\n", "x"), "4096"},
        BadFile{"a.mha", meta("DimSize = 5 4 3\nElementType = MET_OTHER\n", "x"), "MET_OTHER"},
        BadFile{"a.mha",
                meta("DimSize = 5 4 3\nElementType = MET_UCHAR\nElementNumberOfChannels = 3\n", std::string(180, 'x')),
                "components"},
        BadFile{"a.mha",
                meta("DimSize = 5 4 3\nElementType = MET_UCHAR\nElementSpacing = 1 0 1\n", std::string(60, 'x')),
                "flat"},
        BadFile{"a.mha",
                meta("DimSize = 5 4 3\nElementType = MET_UCHAR\nTransformMatrix = 1 2 3\n", std::string(60, 'x')),
                "TransformMatrix"},
        BadFile{"a.mha", meta("DimSize = 5 4 3\nElementType = MET_UCHAR\nOffset = inf 0 0\n", std::string(60, 'x')),
                "inf"},
        BadFile{"a.mha", meta("DimSize = 5 4 3\nElementType = MET_UCHAR\nCompressedData = True\n", "no zlib stream"),
                "damaged"},
        BadFile{"a.mhd",
                "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\nElementDataFile = gone.raw\n",
                "gone.raw"},
        BadFile{"a.mhd",
                "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementType = MET_UCHAR\nElementDataFile = LIST\n",
                "lie in 0 files"}));

std::string nifti(const Nifti& n, const std::string& data) { return nifti_header(kPattern, n) + data; }
std::string nifti_sized(int x, int y, int z, size_t bytes) {
  return nifti_header({{x, y, z}, turned(), 0, 1}, {}) + std::string(bytes, 'x');
}
INSTANTIATE_TEST_SUITE_P(
    Nifti, BadVolume,
    testing::Values(BadFile{"a.nii", "short", "ends within its header"},
                    BadFile{"a.nii", std::string(400, 'x'), "no NIfTI"},
                    BadFile{"a.nii.gz", packed("short"), "ends within its header"},
                    BadFile{"a.nii.gz", "no gzip", "ends within its header"},
                    BadFile{"a.nii", nifti_sized(5, 4, 3, 119), "119 bytes"},
                    BadFile{"a.nii", nifti_sized(4096, 4096, 500, 100), "16777216000 bytes"},
                    BadFile{"a.nii.gz", packed(nifti_sized(4096, 4096, 1000, 100)), "compressed"},
                    BadFile{"a.nii", nifti_sized(30000, 1, 1, 60000), "4096"},
                    BadFile{"a.nii", nifti_sized(-3, 4, 3, 100), "-3"},
                    BadFile{"a.nii", nifti({.type = 128, .bits = 24}, std::string(180, 'x')), "colours"},
                    BadFile{"a.nii", nifti({.type = 32, .bits = 64}, std::string(480, 'x')), "complex"},
                    BadFile{"a.nii", nifti({.type = 99}, std::string(480, 'x')), "99"},
                    BadFile{"a.nii", nifti({.time_steps = 4}, std::string(480, 'x')), "4 time steps"},
                    BadFile{"a.hdr", nifti({.pair = true}, ""), "a.img"}));

std::string vti_of(const std::string& extent, const std::string& array) {
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<ImageData "
      "WholeExtent=\"{}\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\n<Piece Extent=\"{}\">\n<PointData "
      "Scalars=\"a\">{}</PointData>\n</Piece>\n</ImageData>\n</VTKFile>\n",
      extent, extent, array);
}
INSTANTIATE_TEST_SUITE_P(
    Vti, BadVolume,
    testing::Values(
        BadFile{"a.vti", "<VTKFile type=\"ImageData\">", "WholeExtent"}, BadFile{"a.vti", "nothing", "WholeExtent"},
        BadFile{"a.vti", vti_of("0 4095 0 4095 0 499", ""), "8388608000"},
        BadFile{"a.vti", vti_of("0 9999 0 1 0 1", ""), "4096"}, BadFile{"a.vti", vti_of("0 -5 0 1 0 1", ""), "extent"},
        BadFile{"a.vti", vti_of("0 1 0 1 nan 1", ""), "extent"}, BadFile{"a.vti", vti_of("0 1 0 1", ""), "six"},
        BadFile{"a.vti", vti_of("0 1 0 1 0 1", ""), "values"},
        BadFile{"a.vti",
                vti_of("0 1 0 1 0 1", "<DataArray type=\"UInt8\" Name=\"a\" format=\"ascii\">1 2 3</DataArray>"),
                "3 values, 8 are needed"},
        BadFile{"a.vti",
                vti_of("0 1 0 0 0 0",
                       "<DataArray type=\"UInt8\" Name=\"a\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3 4 5 "
                       "6</DataArray>"),
                "3 components"},
        BadFile{"a.vti",
                vti_of("0 1 0 1 0 1", "<DataArray type=\"String\" Name=\"a\" format=\"ascii\">1 2 3</DataArray>"),
                ""}));

TEST(BadVolumeFiles, EmptyMissingAndSpecialOnes) {
  const TempFolder folder;
  for (const char* name : {"a.nrrd", "a.mha", "a.nii", "a.nii.gz", "a.vti"})
    EXPECT_SAYS(refusal(folder.write(name, "")), "empty");
  EXPECT_SAYS(refusal(folder / "gone.nrrd"), "no such file");
  EXPECT_SAYS(refusal("/dev/null"), "not a regular file");
  EXPECT_SAYS(refusal(folder.write("a.txt", "hello")), "no volume");
  EXPECT_FALSE(looks_like_volume(folder / "a.txt"));
  EXPECT_FALSE(looks_like_volume(folder / "gone.nrrd"));
}

// Cuts at every length, up to where all voxels are there: a checksum follows compressed ones, of 8 bytes for gzip and 4
// for zlib.
TEST(BadVolumeFiles, CutAnywhereAreRefused) {
  const TempFolder folder;
  const std::string data = kPattern.bytes<int16_t>();
  struct File {
    std::string name, content;
    size_t behind;
  };
  const File files[] = {
      {"a.nrrd", nrrd_header(kPattern, "int16", kRaw) + data, 0},
      {"b.nrrd", nrrd_header(kPattern, "int16", kGzip) + packed(data), 10},
      {"a.mha", metaimage_header(kPattern, "MET_SHORT", kBinary + "ElementDataFile = LOCAL\n") + data, 0},
      {"b.mha",
       metaimage_header(kPattern, "MET_SHORT", kBinary + "CompressedData = True\nElementDataFile = LOCAL\n") +
           packed(data, 15),
       6}};
  for (const File& file : files)
    for (size_t bytes = 1; bytes + file.behind < file.content.size(); ++bytes) {
      SCOPED_TRACE(fmt::format("{} cut to {}", file.name, bytes));
      refusal(folder.write(file.name, file.content.substr(0, bytes)));
    }
}

TEST(BadVolumeFiles, ChecksumsOfCompressedVoxelsAreLookedAt) {
  const TempFolder folder;
  std::string gzip = packed(kPattern.bytes<int16_t>()), zlib = packed(kPattern.bytes<int16_t>(), 15);
  gzip[gzip.size() - 8] ^= 1, zlib[zlib.size() - 4] ^= 1;
  EXPECT_SAYS(refusal(folder.write("a.nrrd", nrrd_header(kPattern, "int16", kGzip) + gzip)), "check");
  EXPECT_SAYS(
      refusal(folder.write("a.mha", metaimage_header(kPattern, "MET_SHORT",
                                                     kBinary + "CompressedData = True\nElementDataFile = LOCAL\n") +
                                        zlib)),
      "check");
}

TEST(BadVolumeFiles, CutNiftiAndVtkImagesAreRefused) {
  const TempFolder folder;
  const std::string data = kPattern.bytes<int16_t>();
  const std::pair<std::string, std::string> files[] = {
      {"a.nii", nifti_header(kPattern, {}) + data},
      {"a.nii.gz", packed(nifti_header(kPattern, {}) + data)},
      {"a.vti",
       vti_of("0 1 0 1 0 1", "<DataArray type=\"UInt8\" Name=\"a\" format=\"ascii\">1 2 3 4 5 6 7 8</DataArray>")}};
  for (const auto& [name, content] : files)
    for (const double share : {0.05, 0.3, 0.6, 0.8, 0.93}) {
      SCOPED_TRACE(fmt::format("{} at {}", name, share));
      refusal(folder.write(name, content.substr(0, size_t(share * double(content.size())))));
    }
}

TEST(BadVolumeFiles, DicomCutAnywhereIsRefused) {
  for (const auto syntax :
       {DicomWriter::Syntax::kExplicit, DicomWriter::Syntax::kImplicit, DicomWriter::Syntax::kBigEndian}) {
    const TempFolder folder;
    const std::string content = dicom_slice(kPattern, 0, {.syntax = syntax});
    for (size_t bytes = 133; bytes < content.size(); ++bytes) {
      folder.write("a.dcm", content.substr(0, bytes));
      refusal(folder / "", "", folder / "");
    }
  }
}

TEST(BadDicom, IsRefusedByWhatIsWrong) {
  const auto series = [&](const Dicom& other, const std::string& says, Pattern p = kPattern, int k = 1) {
    const TempFolder folder;
    folder.write("0.dcm", dicom_slice(kPattern, 0, {}));
    folder.write("1.dcm", dicom_slice(p, k, other));
    EXPECT_SAYS(refusal(folder / "", "", folder / ""), says);
  };
  series({.slope = "0"}, "scaled by 0");
  series({.bits_stored = 0}, "0 bits");
  const auto alone = [&](const Dicom& d, const std::string& says) {
    const TempFolder folder;
    folder.write("0.dcm", dicom_slice(kPattern, 0, d));
    EXPECT_SAYS(refusal(folder / "0.dcm"), says);
  };
  alone({.syntax_uid = "1.2.840.10008.1.2.4.70"}, "1.2.840.10008.1.2.4.70");
  alone({.components = 3}, "3 components of 16 bits");
  alone({.photometric = "PALETTE COLOR"}, "palette");
}

TEST(BadRaw, SizesAndSpecsThatDoNotFit) {
  const TempFolder folder;
  const std::string path = folder.write("a.raw", std::string(60, 'x'));
  EXPECT_SAYS(refusal(path, "5x4x4:u8"), "80 bytes");
  EXPECT_SAYS(refusal(path, "5x4x2:u8"), "--raw says 5 x 4 x 2");
  EXPECT_SAYS(refusal(path, "5x4x3:u16"), "120 bytes");
  EXPECT_SAYS(refusal(path, "99999x1x1:u8"), "4096");
  for (const char* spec : {"5x4x3", "5x4:u8", "5x4x3:", "5x4x3:u9", "5x4x3:u8:", "5x4x3:u8:1,2", "5x4x3:u8:1,2,0",
                           "5x4x3:u8:1,-2,1", ":u8", "5x4x3x2:u8", "-5x4x3:u8", "5x4x3:u8:1,2,nan",
                           "99999999999999999999x1x1:u8", "5X4X3:u8", "5x4x3:f16", "5x4x3:u8:1,1,1:2"})
    EXPECT_SAYS(refusal(path, spec), "--raw");
  // The error for a wrong type lists all types.
  const std::string types = refusal(path, "5x4x3:uint16");
  EXPECT_SAYS(types, "\"uint16\" is no type");
  for (const char* type : {"u8", "i16", "u32", "f64", "u16be", "little-endian"}) EXPECT_SAYS(types, type);
  const std::string nrrd =
      folder.write("a.nrrd", nrrd_header({{2, 1, 1}, glm::dmat4(1.0), 0, 1}, "uint8", "\n") + "ab");
  EXPECT_SAYS(refusal(nrrd, "5x4x3:u8"), "it is a nrrd file, which tells its layout itself: leave out --raw");
}

TEST(BadFolders, SayWhatTheyHoldInstead) {
  const TempFolder empty;
  EXPECT_SAYS(refusal(empty / ""), "neither");
  EXPECT_FALSE(looks_like_volume(empty / ""));
  const Pattern small{{2, 2, 2}, glm::dmat4(1.0), 0, 1};
  const std::string file = nrrd_header(small, "uint8", "encoding: raw\n\n") + small.bytes<uint8_t>();
  const TempFolder mixed;
  mixed.write("heart.nrrd", file), mixed.write("liver.nrrd", file), mixed.write("p1.nrrd", file);
  EXPECT_SAYS(refusal(mixed / ""), "not one numbered series");
  const TempFolder twice;
  twice.write("p1.nrrd", file), twice.write("p01.nrrd", file);
  EXPECT_SAYS(refusal(twice / ""), "the same number");
  const TempFolder both;
  both.write("p1.nrrd", file), both.write("p.dcm", dicom_slice(kPattern, 0, {}));
  EXPECT_SAYS(refusal(both / ""), "of its own");
}

TEST(BadSeries, StepsOfOtherSizesAreRefusedWithBothSizes) {
  const TempFolder folder;
  const Pattern small{{2, 2, 2}, glm::dmat4(1.0), 0, 1}, large{{3, 2, 2}, glm::dmat4(1.0), 0, 1};
  folder.write("p1.nrrd", nrrd_header(small, "uint8", "encoding: raw\n\n") + small.bytes<uint8_t>());
  folder.write("p2.nrrd", nrrd_header(large, "uint8", "encoding: raw\n\n") + large.bytes<uint8_t>());
  const auto source = find_volume(folder / "");
  ASSERT_TRUE(source.ok()) << source.error().text;
  const auto steps = check_steps(*source);
  const auto second = read_volume(*source, 1, nullptr);
  ASSERT_FALSE(steps.ok());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(steps.error().text, second.error().text);
  EXPECT_SAYS(second.error().text, "3 x 2 x 2");
  EXPECT_SAYS(second.error().text, "2 x 2 x 2");
  EXPECT_TRUE(read_volume(*source, 0, nullptr).ok());
}

// A header that honestly states the size of a bomb: the end of the unpacked bytes ends the reading, not the claim, and
// memory stays at the unpacked size.
TEST(Bombs, ThatPackLessThanTheyClaimTakeNoMemory) {
  const TempFolder folder;
  const std::string zeroes = packed(std::string(1 << 20, '\0'));  // a thousand to one, and no more
  const std::string path =
      folder.write("a.nrrd", with("uint8", "1024 1024 1000", "encoding: gzip\n", zeroes + std::string(1 << 20, '\0')));
  EXPECT_SAYS(refusal(path), "ends too early");
}

// The pipe from the import program: any bytes cause no crash and no memory for claims.
TEST(ImportStream, SurvivesBytesThatAreNoVolume) {
  const auto received = [](const std::string& bytes, uint64_t most) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    EXPECT_EQ(write(ends[1], bytes.data(), bytes.size()), ssize_t(bytes.size()));
    close(ends[1]);
    auto result = receive_volume(ends[0], most, "name", nullptr);
    close(ends[0]);
    return result;
  };
  VolumeFileHeader header;
  header.size = {5, 4, 3};
  header.stored = StoredType::kI16;
  const std::string data = kPattern.bytes<int16_t>();
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_TRUE(send_progress(ends[1], 0.5));
  ASSERT_TRUE(send_volume(ends[1], header, data.data()));
  close(ends[1]);
  std::string stream(4096, '\0');
  stream.resize(size_t(read(ends[0], stream.data(), stream.size())));
  close(ends[0]);
  const auto whole = received(stream, data.size());
  ASSERT_TRUE(whole && whole->ok());
  EXPECT_EQ(std::memcmp(whole->value().bytes.data(), data.data(), data.size()), 0);
  const auto too_much = received(stream, data.size() - 1);
  ASSERT_TRUE(too_much && !too_much->ok());
  for (size_t bytes = 0; bytes < stream.size(); ++bytes)
    EXPECT_FALSE(received(stream.substr(0, bytes), data.size())) << bytes;
  for (size_t at = 0; at < 120 && at < stream.size(); ++at) {
    std::string changed = stream;
    changed[at] = char(changed[at] ^ 0x55);
    const auto result = received(changed, data.size());  // a changed voxel or matrix passes; other changes do no harm
    if (result && result->ok()) {
      EXPECT_LE(result->value().bytes.size(), data.size());
    }
  }
}

}  // namespace
}  // namespace telesplat::data::test
