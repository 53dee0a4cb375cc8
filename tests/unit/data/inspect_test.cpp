// Results of `telesplat inspect` for data sets: true units, choices of a run, values of all steps.
#include "services/data/inspect.h"

#include "tests/support/volume/files.h"

namespace telesplat::data::test {
namespace {

MeshOptions no_cache() {
  MeshOptions out;
  out.use_cache = false;
  return out;
}

void expect_rows(const Description& told, std::initializer_list<const char*> parts) {
  const std::string table = told.table();
  for (const char* part : parts) EXPECT_NE(table.find(part), std::string::npos) << part << " is not in\n" << table;
}

// An SRTM tile: its name gives its place, its size the resolution.
std::string write_tile(const TempFolder& folder) {
  constexpr int kSide = 1201;
  std::string heights;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      heights += raw(x == 7 && y == 9 ? int16_t(-32768) : int16_t(100 + (x + y) / 4), true);
  return folder.write("N42W123.hgt", heights);
}

TEST(Inspect, RangesHaveAsManyDigitsAsTellTheirEndsApart) {
  EXPECT_EQ(range_text(0, 240), "0 .. 240");
  EXPECT_EQ(range_text(-0.123456789, 1), "-0.123457 .. 1");
  EXPECT_EQ(range_text(1e9, 1e9 + 240), "1000000000 .. 1000000240");
  EXPECT_EQ(range_text(101325, 101325.25), "101325 .. 101325.25");
  EXPECT_EQ(range_text(7, 7), "7 .. 7");
}

TEST(Inspect, ARastersUnitsAndColoursAreTrue) {
  const TempFolder folder;
  const auto facts = inspect_mesh(write_tile(folder), no_cache(), nullptr);
  ASSERT_TRUE(facts.ok()) << facts.error().text;
  ASSERT_TRUE(facts->raster.has_value());
  const RasterFacts& r = *facts->raster;
  EXPECT_EQ(r.unit, "degrees");
  EXPECT_NEAR(r.west, -123, 1e-3);
  EXPECT_NEAR(r.north, 43, 1e-3);
  EXPECT_NEAR(r.sample_x_m, 111320.0 / 1200 * std::cos(42.5 * M_PI / 180), 0.1);
  EXPECT_EQ(r.lo, 100);
  EXPECT_EQ(r.hi, 700);
  EXPECT_EQ(r.without_data, 1u);
  const Description told = describe(*facts);
  expect_rows(told, {"an elevation raster", "WGS 84, degrees: west -123", "heights      100 .. 700 m, shown times 1",
                     "1 samples have no data", "none in the file: tinted by height", "metres, made of the degrees",
                     "z (an elevation raster)"});
  EXPECT_EQ(told.json["raster"]["unit"], "degrees");
  EXPECT_EQ(told.json["room"]["up"], "z");
  EXPECT_NEAR(double(told.json["room"]["hi"][2]), 0.4, 1e-6);
}

TEST(Inspect, AGridWithoutASystemSaysSo) {
  const TempFolder folder;
  const std::string path = folder.write(
      "grid.asc", "ncols 4\nnrows 3\nxllcorner 900\nyllcorner 900\ncellsize 1\n1 2 3 4\n1 2 3 4\n1 2 3 5\n");
  EXPECT_TRUE(is_mesh_file(path));
  const auto facts = inspect_mesh(path, no_cache(), nullptr);
  ASSERT_TRUE(facts.ok()) << facts.error().text;
  expect_rows(describe(*facts), {"units: west 900, east 904", "does not say in what system its coordinates are",
                                 "1 .. 5 m, shown times 1 (--z-scale)"});
}

TEST(Inspect, APictureIsNoElevationAndTheLineSaysWhatIs) {
  const TempFolder folder;
  using namespace std::string_literals;
  const std::string start = "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\2\0\0\0\2"s;
  const std::string deep = folder.write("dem.png", start + "\x10\0\0\0\0"s),
                    flat = folder.write("photo.png", start + "\x8\2\0\0\0"s);
  EXPECT_TRUE(is_mesh_file(deep)) << "16 bits of grey are elevation";
  EXPECT_FALSE(is_mesh_file(flat));
  for (const char* part : {"8-bit colours", "one band of 16 bits", "--texture"})
    EXPECT_NE(why_no_mesh(flat).find(part), std::string::npos) << why_no_mesh(flat);
  EXPECT_EQ(why_no_mesh(deep), "");
}

TEST(Inspect, ASeriesValuesAreThoseOfAllStepsOrOfTheFirstAndItIsSaid) {
  const TempFolder folder;
  for (const int step : {0, 1, 2}) {
    const Pattern p{{64, 64, 64}, glm::dmat4(1.0), 10.0 * step, 0};
    folder.write(fmt::format("phase{}.nrrd", step), nrrd_header(p, "uint8", "encoding: raw\n\n") + p.bytes<uint8_t>());
  }
  const auto all = inspect_volume(folder / "", {}, {}, nullptr);
  ASSERT_TRUE(all.ok()) << all.error().text;
  EXPECT_EQ(all->steps_read, 3u);
  EXPECT_EQ(all->session.range.lo, 0);
  EXPECT_EQ(all->session.range.hi, 20);
  expect_rows(describe(*all), {"that changes with time", "0 .. 20, of all 3 steps", "first step, 0 .. 0",
                               "3: phase0.nrrd .. phase2.nrrd, 3 a second"});
  VolumeOptions tight;
  tight.cache_mb = 0;
  const auto first = inspect_volume(folder / "", tight, {}, nullptr);
  ASSERT_TRUE(first.ok()) << first.error().text;
  EXPECT_EQ(first->steps_read, 1u);
  expect_rows(describe(*first), {"0 .. 0, of the first step alone"});
}

TEST(Inspect, AVolumesUnitIsTheOneItsFileSays) {
  const TempFolder folder;
  const Pattern p{{5, 4, 3}, glm::dmat4(1.0), 0, 1};
  const auto unit_of = [&](const std::string& path) -> std::string {
    const auto facts = inspect_volume(path, {}, {}, nullptr);
    EXPECT_TRUE(facts.ok()) << path << (facts ? "" : facts.error().text);
    return facts ? std::string(describe(*facts).json["unit"]) : "";
  };
  std::string nifti = nifti_header(p, {}) + p.bytes<int16_t>();
  EXPECT_EQ(unit_of(folder.write("none.nii", nifti)), "the file's own units");
  nifti[123] = 2 | 8;  // millimetres, seconds
  EXPECT_EQ(unit_of(folder.write("mm.nii", nifti)), "mm");
  const auto nrrd = [&](const std::string& units) {
    return nrrd_header(p, "uint8", "space units: " + units + "\nencoding: raw\n\n") + p.bytes<uint8_t>();
  };
  EXPECT_EQ(unit_of(folder.write("um.nrrd", nrrd("\"um\" \"um\" \"um\""))), "um");
  EXPECT_EQ(unit_of(folder.write("cut.nrrd", nrrd("\"" + std::string(100, 'u')))), std::string(16, 'u'));
  std::filesystem::create_directory(folder / "scan");
  for (int k = 0; k < 3; ++k) folder.write(fmt::format("scan/{}.dcm", k), dicom_slice(p, k, {}));
  EXPECT_EQ(unit_of(folder / "scan"), "mm");
}

TEST(Inspect, APatientsAxesAreNamed) {
  const TempFolder folder;
  const Pattern p{{5, 4, 3}, glm::dmat4(1.0), 0, 1};
  const auto facts =
      inspect_volume(folder.write("a.nii", nifti_header(p, {.sform = true}) + p.bytes<int16_t>()), {}, {}, nullptr);
  ASSERT_TRUE(facts) << facts.error().text;
  const Description told = describe(*facts);
  EXPECT_EQ(told.json["space"], "RAS");
  expect_rows(told, {"x grows to the right, y to the front, z to the head (RAS)"});
}

TEST(Inspect, AVolumeTellsWhatARunWouldChoose) {
  const TempFolder folder;
  std::string stored;
  for (int i = 0; i < 64; ++i) stored += raw(int16_t(i < 32 ? -1000 : 1500));
  const std::string path = folder.write("ct.raw", stored);
  VolumeOptions options;
  options.raw = "4x4x4:i16:1,1,2";
  const auto facts = inspect_volume(path, options, {.room_size_m = 2}, nullptr);
  ASSERT_TRUE(facts.ok()) << facts.error().text;
  const Description told = describe(*facts);
  expect_rows(told, {"Hounsfield units", "--tf bone (fits Hounsfield units)", "z (volumes stand on z)",
                     "1.000 x 2.000 x 1.000 m"});
  EXPECT_EQ(told.json["transfer"]["name"], "bone");
  EXPECT_EQ(told.json["voxels"], (nlohmann::ordered_json{4, 4, 4}));
  options.transfer = "fire";
  const auto other = inspect_volume(path, options, {.up = "-x"}, nullptr);
  ASSERT_TRUE(other.ok());
  expect_rows(describe(*other), {"--tf fire (--tf)", "-x (--up)"});
  options.transfer = "nosuch";
  EXPECT_FALSE(inspect_volume(path, options, {}, nullptr).ok()) << "as run refuses it";
}

TEST(Inspect, ArraysAreListedWithTheirRanges) {
  const TempFolder folder;
  const std::string path = folder.write(
      "warm.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float "
      "warmth\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 -2.5\n1 0 0 7\n0 1 0 3\n3 0 1 "
      "2\n");
  const auto facts = inspect_mesh(path, no_cache(), nullptr);
  ASSERT_TRUE(facts.ok()) << facts.error().text;
  const Description told = describe(*facts);
  expect_rows(told, {"arrays", "warmth, of points: -2.5 .. 7", "--colour-by"});
  ASSERT_EQ(told.json["arrays"].size(), 1u);
  EXPECT_EQ(told.json["arrays"][0]["spans"][0], (nlohmann::ordered_json{-2.5, 7.0}));
}

TEST(Inspect, AStoreOfTheCacheTellsWhatItHolds) {
  const TempFolder folder;
  MeshOptions options;
  options.cache_dir = folder / "cache";
  const std::string mesh = folder.write("grid.ply", ply_of(wavy_grid(8)));
  ASSERT_TRUE(inspect_mesh(mesh, options, nullptr).ok());
  std::string store;
  for (const auto& entry : std::filesystem::directory_iterator(options.cache_dir))
    if (entry.path().extension() == ".mesh") store = entry.path().string();
  const auto facts = inspect_store(store);
  ASSERT_TRUE(facts.ok()) << facts.error().text;
  EXPECT_EQ(facts->info.triangles, 128u);
  const auto none = inspect_store(mesh);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().text.find("grid.ply"), std::string::npos);
}

TEST(Description, IsSafeForTerminalsAndValidJsonWhateverFilesAreCalled) {
  Description told("mesh", "a\x1b[31m\n.ply: a mesh");
  told.row("name", "b\r\nc");
  told.json["name"] = "caf\xe9";
  EXPECT_EQ(told.table(), "a?[31m?.ply: a mesh\n  name  b??c\n");
  const auto again = nlohmann::json::parse(told.to_json(), nullptr, false);
  ASSERT_TRUE(again.is_object());
  EXPECT_EQ(again["what"], "mesh");
}

}  // namespace
}  // namespace telesplat::data::test
