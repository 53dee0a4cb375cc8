#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmSwapper.h>
#include <gdcmTrace.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <sstream>

#include "services/data/import/dicom.h"
#include "tests/support/volume/dicom_files.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;
using gdcm::TransferSyntax;

// Returns a file whose pixels GDCM has packed. make: makes a plain file that claims a transfer syntax ("": its own).
std::string compressed(const std::function<std::string(const std::string&)>& make, TransferSyntax::TSType syntax) {
  gdcm::Trace::WarningOff(), gdcm::Trace::ErrorOff();
  std::istringstream in(make(""));
  gdcm::ImageReader reader;
  reader.SetStream(in);
  EXPECT_TRUE(reader.Read());
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(syntax);
  change.SetInput(reader.GetImage());
  EXPECT_TRUE(change.Change());
  std::ostringstream fragments;
  change.GetOutput().GetDataElement().GetSequenceOfFragments()->Write<gdcm::SwapperNoOp>(fragments);
  const std::string plain = make(TransferSyntax::GetTSString(syntax));
  const std::string pixels("\xe0\x7f\x10\0OW", 6);
  return plain.substr(0, plain.rfind(pixels)) + std::string("\xe0\x7f\x10\0OB\0\0\xff\xff\xff\xff", 12) +
         fragments.str();
}

class CompressedDicom : public testing::TestWithParam<TransferSyntax::TSType> {};

TEST_P(CompressedDicom, IsReadLikeThePlainOne) {
  const TempFolder folder;
  Pattern p{{17, 9, 3}, turned(), -200, 3};
  p.index_to_data[2] *= 1.5;
  for (int k = 0; k < 3; ++k) {
    Dicom d{.modality = "CT", .slope = "2", .intercept = "-1024", .icon = false};
    const auto make = [&](const std::string& uid) {
      d.syntax_uid = uid;
      return dicom_slice(p, k, d);
    };
    folder.write(fmt::format("{}.dcm", 3 - k), compressed(make, GetParam()));
  }
  expect_same(read_or_fail(folder / ""), p, 2, -1024);
}

TEST_P(CompressedDicom, EnhancedFramesKeepTheirOwnScales) {
  const TempFolder folder;
  const Pattern p{{17, 9, 3}, turned(), -200, 3};
  Enhanced e;
  e.frames = {{2, "1", "0"}, {0, "1", "0"}, {1, "3", "5"}};
  const auto make = [&](const std::string& uid) {
    e.syntax_uid = uid;
    return enhanced_dicom(p, e);
  };
  const std::string path = folder.write("a.dcm", compressed(make, GetParam()));
  const Volume v = read_or_fail(path);
  ASSERT_EQ(v.size, p.size);
  EXPECT_EQ(v.value(0), p.value(0, 0, 0));
  EXPECT_EQ(v.value(17 * 9), p.value(0, 0, 1) * 3 + 5);
  EXPECT_EQ(v.value(17 * 9 * 3 - 1), p.value(16, 8, 2));
}

TEST_P(CompressedDicom, CutAnywhereNeitherCrashesNorGivesVoxels) {
  const Pattern p{{17, 9, 1}, turned(), -200, 3};
  const auto make = [&](const std::string& uid) { return dicom_slice(p, 0, {.syntax_uid = uid, .icon = false}); };
  const std::string content = compressed(make, GetParam());
  const auto whole = decode_dicom(content, "a.dcm");
  ASSERT_TRUE(whole.ok()) << whole.error().text;
  ASSERT_EQ(whole->pixels.size(), 17u * 9 * 2);
  const TempFolder folder;
  const size_t pixels = content.find(std::string("\xe0\x7f\x10\0", 4));
  for (size_t cut = pixels; cut < content.size() - 20; cut += 40) {
    const std::string path = folder.write("a.dcm", content.substr(0, cut));
    const auto source = find_volume(path);
    const auto volume = source ? read_volume(*source, 0, nullptr) : source.error();
    if (volume.ok()) continue;  // a codec may return partial data
    EXPECT_EQ(volume.error().text.find(fs::path(path).parent_path().string()), 0u) << volume.error().text;
  }
}

INSTANTIATE_TEST_SUITE_P(Syntaxes, CompressedDicom,
                         testing::Values(TransferSyntax::JPEGLosslessProcess14_1, TransferSyntax::JPEGLSLossless,
                                         TransferSyntax::JPEG2000Lossless, TransferSyntax::RLELossless),
                         [](const auto& info) { return fmt::format("syntax_{}", int(info.param)); });

TEST(DicomColours, BecomeGrey) {
  DicomWriter w(DicomWriter::Syntax::kExplicit);
  w.put(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.7");
  w.put(0x00080018, "UI", "1.2.3");
  w.put(0x0020000e, "UI", "1.2.3");
  w.put16(0x00280002, 3);
  w.put(0x00280004, "CS", "RGB");
  w.put16(0x00280006, 0);
  for (const uint32_t tag : {0x00280010, 0x00280011}) w.put16(tag, 2);
  for (const auto& [tag, bits] : {std::pair(0x00280100, 8), std::pair(0x00280101, 8), std::pair(0x00280102, 7)})
    w.put16(uint32_t(tag), uint16_t(bits));
  w.put16(0x00280103, 0);
  w.put(0x7fe00010, "OB", std::string("\xff\0\0\0\xff\0\0\0\xff\x10\x20\x30", 12));
  const TempFolder folder;
  const Volume v = read_or_fail(folder.write("a.dcm", w.content()));
  EXPECT_EQ(v.type, VoxelType::kU8);
  const double grey[] = {76, 150, 29, 29};
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(v.value(i), grey[i]) << i;
  EXPECT_NE(v.remark.find("colours are shown as their brightness"), std::string::npos) << v.remark;
}

TEST(DicomFolders, AreSearchedBelowADiscAndByOneSlice) {
  const Pattern p{{5, 4, 3}, turned(), 0, 1};
  const TempFolder folder;
  fs::create_directories(folder / "IMAGES/A/B");
  for (int k = 0; k < 3; ++k) folder.write(fmt::format("IMAGES/A/B/IM{}", k), dicom_slice(p, k, {.preamble = k > 0}));
  folder.write("README.TXT", "a disc");
  EXPECT_TRUE(looks_like_volume(folder / ""));
  expect_same(read_or_fail(folder / ""), p);
  expect_same(read_or_fail(folder / "IMAGES/A/B/IM1"), p);
  DicomWriter directory(DicomWriter::Syntax::kExplicit);
  directory.put(0x00041130, "CS", "DISC");
  folder.write("DICOMDIR", directory.content());
  const auto disc = find_volume(folder / "DICOMDIR");
  ASSERT_TRUE(disc.ok()) << disc.error().text;
  EXPECT_EQ(disc->files().size(), 3u);
  expect_same(read_or_fail(folder / "DICOMDIR"), p);
}

TEST(DicomFolders, AMissingSliceIsMixedAndACutOneLeftOut) {
  Pattern p{{5, 4, 5}, turned(), 0, 2};
  const TempFolder folder;
  for (int k = 0; k < 5; ++k) folder.write(fmt::format("{}.dcm", k), dicom_slice(p, k, {}));
  const std::string cut = dicom_slice(p, 3, {});
  folder.write("3.dcm", cut.substr(0, cut.size() - 10));
  const Volume v = read_or_fail(folder / "");
  expect_same(v, p);
  EXPECT_NE(v.remark.find("left out 1 damaged files"), std::string::npos) << v.remark;
  EXPECT_NE(v.remark.find("1 missing slice, 2 mm apart"), std::string::npos) << v.remark;
}

TEST(DicomFolders, TimeStepsAreASeries) {
  const TempFolder folder;
  for (int t = 0; t < 2; ++t)
    for (int k = 0; k < 3; ++k)
      folder.write(fmt::format("{}{}.dcm", t, k),
                   dicom_slice({{5, 4, 3}, turned(), t * 100.0, 1}, k, {.temporal_position = 2 - t}));
  const auto source = find_volume(folder / "");
  ASSERT_TRUE(source.ok()) << source.error().text;
  ASSERT_EQ(source->steps.size(), 2u);
  EXPECT_TRUE(check_steps(*source).ok());
  expect_same(read_or_fail(folder / "", "", 0), {{5, 4, 3}, turned(), 100, 1});
  expect_same(read_or_fail(folder / "", "", 1), {{5, 4, 3}, turned(), 0, 1});
}

TEST(DicomValues, OfMonochrome1AreTurnedRoundUnlessTheyHaveAScale) {
  const Pattern p{{5, 4, 3}, turned(), 0, 1};
  const TempFolder plain, scaled;
  for (int k = 0; k < 3; ++k) {
    plain.write(fmt::format("{}.dcm", k),
                dicom_slice(p, k, {.bits_stored = 12, .representation = 0, .photometric = "MONOCHROME1"}));
    scaled.write(fmt::format("{}.dcm", k), dicom_slice(p, k, {.slope = "2", .photometric = "MONOCHROME1"}));
  }
  expect_same(read_or_fail(plain / ""), p, -1, 4095);
  expect_same(read_or_fail(scaled / ""), p, 2);
}

TEST(DicomValues, PaddingFarFromAllOthersIsTheLowest) {
  const Pattern p{{5, 4, 1}, turned(), -2000, 100};
  const TempFolder folder;
  // The first voxel is padding; the others are 100 apart: 5 % of their range.
  folder.write("0.dcm", dicom_slice(p, 0, {.padding = -2000}));
  const Volume v = read_or_fail(folder / "");
  EXPECT_EQ(v.value(0), -1900);
  EXPECT_EQ(v.lo, -1900);
  EXPECT_NE(v.remark.find("1 voxels are padding (-2000)"), std::string::npos) << v.remark;
}

}  // namespace
}  // namespace telesplat::data
