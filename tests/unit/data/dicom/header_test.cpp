#include <gtest/gtest.h>

#include "services/data/volume/formats/dicom.h"
#include "tests/support/volume/dicom_files.h"

namespace telesplat::data {
namespace {

using namespace test;

const Pattern kPattern{{5, 4, 3}, turned(), 0, 1};

std::vector<DicomSlice> parsed(const std::string& content) {
  auto slices = parse_dicom(content, "a.dcm");
  EXPECT_TRUE(slices.ok()) << (slices ? "" : slices.error().text);
  return slices ? *slices : std::vector<DicomSlice>{};
}

class EnhancedDicom : public testing::TestWithParam<std::pair<DicomWriter::Syntax, bool>> {};

TEST_P(EnhancedDicom, GivesEachFrameItsOwnPlaceAndScale) {
  Enhanced e{.syntax = GetParam().first, .undefined = GetParam().second};
  e.frames = {{2, "2", "7"}, {0, "1", "0"}, {1, "0.5", "-1"}};
  const auto slices = parsed(enhanced_dicom(kPattern, e));
  ASSERT_EQ(slices.size(), 3u);
  for (size_t f = 0; f < 3; ++f) {
    const DicomSlice& s = slices[f];
    EXPECT_EQ(s.frame, int(f));
    EXPECT_EQ(s.pixels.slope, (std::array{2.0, 1.0, 0.5})[f]);
    EXPECT_EQ(s.pixels.intercept, (std::array{7.0, 0.0, -1.0})[f]);
    const glm::dvec3 at(kPattern.index_to_data * glm::dvec4(0, 0, e.frames[f].k, 1));
    ASSERT_TRUE(s.plane.position);
    EXPECT_LT(glm::distance(*s.plane.position, at), 1e-9);
    EXPECT_LT(glm::distance(s.plane.along_row, glm::normalize(glm::dvec3(kPattern.index_to_data[0]))), 1e-9);
    EXPECT_EQ(s.plane.spacing, glm::dvec2(0.5, 0.75));
    EXPECT_FALSE(s.plane.stacked);
    EXPECT_EQ(s.data.bytes, 40u);
    EXPECT_EQ(s.data.at, slices[0].data.at + 40 * f);
  }
}

INSTANTIATE_TEST_SUITE_P(Syntaxes, EnhancedDicom,
                         testing::Values(std::pair(DicomWriter::Syntax::kExplicit, true),
                                         std::pair(DicomWriter::Syntax::kExplicit, false),
                                         std::pair(DicomWriter::Syntax::kImplicit, true),
                                         std::pair(DicomWriter::Syntax::kImplicit, false),
                                         std::pair(DicomWriter::Syntax::kBigEndian, false)));

TEST(DicomHeader, TakesNothingFromSequencesThatAreNoFunctionalGroups) {
  DicomWriter w(DicomWriter::Syntax::kExplicit), other = DicomWriter::item(DicomWriter::Syntax::kExplicit);
  other.put(0x00281053, "DS", "9");
  w.put(0x00281053, "DS", "2");
  w.put_sequence(0x00082112, {other.content()});  // Source Image Sequence
  w.put_sequence(0x00082112, {other.content()}, false);
  EXPECT_EQ(parsed(w.content())[0].pixels.slope, 2);
}

TEST(DicomHeader, KnowsFilesWithoutPreamble) {
  for (const auto syntax : {DicomWriter::Syntax::kExplicit, DicomWriter::Syntax::kImplicit}) {
    const std::string bare = dicom_slice(kPattern, 1, {.syntax = syntax, .uid = "1.2", .preamble = false});
    ASSERT_TRUE(is_dicom(bare));
    EXPECT_EQ(parsed(bare)[0].pixels.rows, 4);
  }
  std::string counting;  // a raw file whose first values look like a tag
  for (uint16_t v = 8; v < 200; ++v) counting += raw(v);
  EXPECT_FALSE(is_dicom(counting));
  EXPECT_FALSE(is_dicom(std::string(200, '\0')));
  EXPECT_FALSE(is_dicom("\x08"));
}

TEST(DicomHeader, BelievesTheElementsRatherThanTheSyntaxThatTheyClaim) {
  const std::string said_explicit = "1.2.840.10008.1.2.1";
  const auto slices =
      parsed(dicom_slice(kPattern, 0, {.syntax = DicomWriter::Syntax::kImplicit, .syntax_uid = said_explicit}));
  EXPECT_EQ(slices[0].pixels.columns, 5);
}

TEST(DicomHeader, InflatesDeflatedElements) {
  const std::string plain = dicom_slice(kPattern, 2, {.syntax_uid = "1.2.840.10008.1.2.1.99"});
  const size_t begin = plain.find(std::string("\x08\0", 2), 132);
  const std::string deflated = plain.substr(0, begin) + packed(plain.substr(begin), -15);
  const auto slices = parsed(deflated);
  EXPECT_TRUE(slices[0].data.deflated);
  EXPECT_EQ(slices[0].instance, 3);
  const auto inflated = inflate_dicom(deflated, "a.dcm");
  ASSERT_TRUE(inflated.ok());
  EXPECT_EQ(*inflated, plain.substr(begin));
  for (size_t cut = begin; cut + 1 < deflated.size(); cut += 7)
    EXPECT_FALSE(parse_dicom(deflated.substr(0, cut), "a.dcm").ok());
}

TEST(DicomHeader, StacksFramesWithoutPositionsAndPlacesThoseOfADose) {
  Enhanced e{.groups = false};
  e.frames = {{0}, {1}, {2}};
  auto slices = parsed(enhanced_dicom(kPattern, e));
  ASSERT_EQ(slices.size(), 3u);
  EXPECT_TRUE(slices[1].plane.stacked);
  EXPECT_FALSE(slices[1].plane.position);
  e.offsets = "0\\2.5\\7";
  slices = parsed(enhanced_dicom(kPattern, e));
  ASSERT_TRUE(slices[2].plane.position);
  EXPECT_NEAR(glm::distance(*slices[2].plane.position, *slices[0].plane.position), 7, 1e-9);
  EXPECT_FALSE(slices[2].plane.stacked);
}

TEST(DicomHeader, RefusesFramesThatItsPixelsCannotHold) {
  Enhanced e{.claimed_frames = "4"};
  e.frames = {{0}, {1}, {2}};
  auto refused = parse_dicom(enhanced_dicom(kPattern, e), "a.dcm");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("has 4 frames, and places 3"), std::string::npos) << refused.error().text;
  e.groups = false, e.claimed_frames = "60000";
  refused = parse_dicom(enhanced_dicom(kPattern, e), "a.dcm");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("claims 60000 frames"), std::string::npos) << refused.error().text;
  e.claimed_frames = "99999999";
  refused = parse_dicom(enhanced_dicom(kPattern, e), "a.dcm");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("limit 65536"), std::string::npos) << refused.error().text;
}

TEST(DicomHeader, EnhancedFilesCutAnywhereAreRefused) {
  for (const bool undefined : {false, true}) {
    Enhanced e{.undefined = undefined};
    e.frames = {{1}, {0}};
    const std::string content = enhanced_dicom(kPattern, e);
    for (size_t bytes = 133; bytes < content.size(); ++bytes) {
      const auto slices = parse_dicom(content.substr(0, bytes), "a.dcm");
      EXPECT_TRUE(!slices.ok() || slices->front().data.bytes == 0) << bytes;
    }
  }
}

}  // namespace
}  // namespace telesplat::data
