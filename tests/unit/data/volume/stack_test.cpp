// Volumes whose slices are pictures: pages of a TIFF file, or a folder of TIFF or PNG files.
#include "services/data/volume/formats/stack.h"

#include <zlib.h>

#include "services/data/inspect.h"
#include "tests/support/volume/files.h"

namespace telesplat::data::test {
namespace {

struct TiffPage {
  std::string pixels;
  int width = 5, height = 4, bits = 16, format = 1, samples = 1, subfile = 0;
  std::string description;
  bool placed = false;
};

// A TIFF file without compression, a strip a page. big: Motorola's byte order; large: BigTIFF.
std::string tiff(const std::vector<TiffPage>& pages, bool big = false, bool large = false) {
  const auto offset = [&](uint64_t value) { return large ? raw(value, big) : raw(uint32_t(value), big); };
  std::string out = big ? "MM" : "II";
  out += large ? raw(uint16_t(43), big) + raw(uint16_t(8), big) + raw(uint16_t(0), big) : raw(uint16_t(42), big);
  size_t link = out.size();
  out += offset(0);
  for (const TiffPage& p : pages) {
    const uint64_t pixels_at = out.size();
    out += p.pixels;
    const uint64_t text_at = out.size();
    out += p.description.empty() ? "" : p.description + std::string(1, '\0');
    std::vector<std::string> entries;
    const auto entry = [&](uint16_t tag, uint16_t type, uint64_t count, uint64_t value) {
      std::string field = type == 3 ? raw(uint16_t(value), big) : type == 2 ? offset(value) : raw(uint32_t(value), big);
      field.resize(large ? 8 : 4, '\0');
      entries.push_back(raw(tag, big) + raw(type, big) + offset(count) + field);
    };
    entry(254, 4, 1, uint64_t(p.subfile)), entry(256, 3, 1, uint64_t(p.width)), entry(257, 3, 1, uint64_t(p.height));
    entry(258, 3, 1, uint64_t(p.bits)), entry(259, 3, 1, 1), entry(262, 3, 1, 1);
    if (!p.description.empty()) entry(270, 2, p.description.size() + 1, text_at);
    entry(273, 4, 1, pixels_at), entry(277, 3, 1, uint64_t(p.samples)), entry(278, 3, 1, uint64_t(p.height));
    entry(279, 4, 1, p.pixels.size()), entry(339, 3, 1, uint64_t(p.format));
    if (p.placed) entry(34735, 3, 1, 1);
    out.replace(link, large ? 8 : 4, offset(out.size()));
    out += large ? raw(uint64_t(entries.size()), big) : raw(uint16_t(entries.size()), big);
    for (const std::string& e : entries) out += e;
    link = out.size();
    out += offset(0);
  }
  return out;
}

// A PNG of grey, 8 or 16 bits.
std::string png(const std::string& pixels, uint32_t width, uint32_t height, int bits, int colours = 0) {
  const auto chunk = [](const std::string& type, const std::string& data) {
    const std::string body = type + data;
    return raw(uint32_t(data.size()), true) + body +
           raw(uint32_t(crc32(0, reinterpret_cast<const Bytef*>(body.data()), uInt(body.size()))), true);
  };
  const size_t row = pixels.size() / height;
  std::string rows;
  for (size_t y = 0; y < height; ++y) rows += '\0' + pixels.substr(y * row, row);
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", raw(width, true) + raw(height, true) + char(bits) + char(colours) + std::string(3, '\0')) +
         chunk("IDAT", packed(rows, 15)) + chunk("IEND", "");
}

class Stack : public testing::Test {
 protected:
  template <class T>
  std::vector<TiffPage> pages(int bits, int format, bool big = false) const {
    const std::string all = p.bytes<T>(big);
    std::vector<TiffPage> out;
    for (size_t k = 0; k < 3; ++k)
      out.push_back({.pixels = all.substr(k * all.size() / 3, all.size() / 3), .bits = bits, .format = format});
    return out;
  }
  const TempFolder folder;
  const Pattern p{{5, 4, 3}, glm::dmat4(1.0), 1, 1};
};

TEST_F(Stack, PagesOfATiffFileAreSlices) {
  for (const bool big : {false, true})
    for (const bool large : {false, true}) {
      const std::vector<std::string> files{folder.write("u8.tif", tiff(pages<uint8_t>(8, 1, big), big, large)),
                                           folder.write("u16.tif", tiff(pages<uint16_t>(16, 1, big), big, large)),
                                           folder.write("i16.tif", tiff(pages<int16_t>(16, 2, big), big, large)),
                                           folder.write("f32.tif", tiff(pages<float>(32, 3, big), big, large))};
      for (const std::string& file : files) {
        EXPECT_TRUE(looks_like_volume(file));
        const Volume v = read_or_fail(file);
        expect_same(v, p);
        EXPECT_EQ(v.format, "stack");
      }
    }
}

TEST_F(Stack, ReducedCopiesAndMasksAreNone) {
  auto all = pages<uint16_t>(16, 1);
  all.insert(all.begin() + 1, {.pixels = std::string(16, 'x'), .width = 4, .height = 2, .subfile = 1});
  expect_same(read_or_fail(folder.write("a.tif", tiff(all))), p);
  // A picture with its overviews is no stack, and neither is a raster of several pages.
  EXPECT_FALSE(looks_like_volume(folder.write("one.tif", tiff({all[0], all[1]}))));
  for (TiffPage& page : all) page.placed = true;
  EXPECT_FALSE(looks_like_volume(folder.write("placed.tif", tiff(all))));
}

TEST_F(Stack, ImageJWritesOneDirectoryForAllSlices) {
  for (const bool big : {false, true}) {
    TiffPage page = pages<uint16_t>(16, 1, big)[0];
    page.pixels = p.bytes<uint16_t>(big);
    page.description = "ImageJ=1.53t\nimages=3\nslices=3\nunit=micron\nspacing=2.5\n";
    const Volume v = read_or_fail(folder.write("a.tif", tiff({page}, big)));
    Pattern spaced = p;
    spaced.index_to_data[2][2] = 2.5;
    expect_same(v, spaced);
    EXPECT_EQ(v.unit, "micron");
    page.pixels.resize(page.pixels.size() - 1);  // the directory behind it is no pixel
    const auto pages = tiff_pages(tiff({page}, big).substr(0, 8 + page.pixels.size()));
    EXPECT_FALSE(pages) << "its directory is gone";
  }
}

TEST_F(Stack, ImageJsOtherFilesAreStacksTooUnlessTheyHaveMoreAxes) {
  // A directory a slice, and a list of as many images: each is counted once.
  auto all = pages<uint16_t>(16, 1);
  all[0].description = "ImageJ=1.11a\nimages=3\nslices=3\n";
  expect_same(read_or_fail(folder.write("a.tif", tiff(all))), p);
  // A writer that does not know the axes calls them channels.
  TiffPage page = pages<uint16_t>(16, 1)[0];
  page.pixels = p.bytes<uint16_t>();
  page.description = "ImageJ=1.11a\nimages=3\nchannels=3\nmode=grayscale\n";
  expect_same(read_or_fail(folder.write("b.tif", tiff({page}))), p);
  page.pixels += page.pixels;
  page.description = "ImageJ=1.11a\nimages=6\nchannels=2\nslices=3\n";
  const auto source = find_volume(folder.write("c.tif", tiff({page})));
  ASSERT_TRUE(source);
  EXPECT_FALSE(read_volume(*source, 0, nullptr));
}

TEST_F(Stack, AFolderOfPicturesIsInOrderOfItsNumbers) {
  const auto all = pages<uint16_t>(16, 1);
  for (const char* name : {"9", "10", "11"})
    folder.write(fmt::format("s{}.tif", name), tiff({all[std::string(name) == "9" ? 0 : name[1] - '0' + 1]}));
  folder.write("notes.txt", "how it was made");
  EXPECT_TRUE(looks_like_volume(folder / ""));
  const auto source = find_volume(folder / "", {.spacing = "0.5,1,2"});
  ASSERT_TRUE(source) << source.error().text;
  EXPECT_EQ(source->files().size(), 3u);
  const auto v = read_volume(*source, 0, nullptr);
  ASSERT_TRUE(v) << v.error().text;
  Pattern spaced = p;
  spaced.index_to_data[0][0] = 0.5, spaced.index_to_data[2][2] = 2;
  expect_same(*v, spaced);
}

TEST_F(Stack, PngFilesOfEightAndSixteenBits) {
  const TempFolder other;
  for (size_t k = 0; k < 3; ++k) {
    folder.write(fmt::format("{}.png", k), png(p.bytes<uint8_t>().substr(20 * k, 20), 5, 4, 8));
    other.write(fmt::format("{}.png", k), png(p.bytes<uint16_t>(true).substr(40 * k, 40), 5, 4, 16));
  }
  expect_same(read_or_fail(folder / ""), p);
  expect_same(read_or_fail(other / ""), p);
}

TEST_F(Stack, WhatFitsTogetherInNoWayIsRefusedByName) {
  const auto refusal = [&](const std::string& path) {
    const auto source = find_volume(path);
    if (!source) return source.error().text;
    const auto v = read_volume(*source, 0, nullptr);
    return v ? std::string() : v.error().text;
  };
  auto all = pages<uint16_t>(16, 1);
  folder.write("1.tif", tiff({all[0]}));
  folder.write("2.tif", tiff({{.pixels = std::string(24, 'x'), .width = 4, .height = 3}}));
  EXPECT_NE(refusal(folder / "").find("2.tif: is a picture of 4 x 3"), std::string::npos) << refusal(folder / "");
  folder.write("2.tif", tiff({{.pixels = std::string(60, 'x'), .bits = 8, .samples = 3}}));
  EXPECT_NE(refusal(folder / "").find("2.tif: has 3 channels"), std::string::npos) << refusal(folder / "");
  folder.write("2.tif", std::string("II*\0damaged", 11));
  EXPECT_NE(refusal(folder / "").find("2.tif"), std::string::npos) << refusal(folder / "");
  const auto spaced = find_volume(folder.write("a.tif", tiff(all)), {.spacing = "1,2"});
  ASSERT_TRUE(spaced);
  EXPECT_FALSE(read_volume(*spaced, 0, nullptr));
}

TEST_F(Stack, DamagedTiffFilesAreNoVolumeAndEnd) {
  const std::string whole = tiff(pages<uint16_t>(16, 1));
  for (size_t bytes = 0; bytes < whole.size(); ++bytes) tiff_pages(whole.substr(0, bytes));
  std::string looped = whole;  // the last directory leads to the first one again
  looped.replace(looped.size() - 4, 4, looped.substr(4, 4));
  EXPECT_FALSE(tiff_pages(looped));
}

}  // namespace
}  // namespace telesplat::data::test
