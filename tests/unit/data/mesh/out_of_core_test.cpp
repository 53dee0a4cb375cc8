// Meshes that are read here and there: their stores hold what stores of whole meshes hold, in parts of a file's size.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "common/core/descriptor.h"
#include "common/geometry/chunk_code.h"
#include "common/image/normal.h"
#include "services/data/base/elevation.h"
#include "services/data/mesh/formats/readers.h"
#include "services/data/mesh/out_of_core/build.h"
#include "services/data/mesh/out_of_core/partition.h"
#include "services/data/mesh/out_of_core/preview.h"
#include "services/data/mesh/reader.h"
#include "services/data/mesh/store_file.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void nothing(const char*, double) {}

// A binary PLY of doubles, with colours if the mesh has any. more: another property of vertices, "heat", its number.
std::string binary_ply(const Mesh& mesh, bool big_endian = false, bool more = false) {
  std::string out = fmt::format(
      "ply\nformat binary_{}_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
      big_endian ? "big" : "little", mesh.positions.size());
  if (!mesh.colours.empty()) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (more) out += "property float heat\n";
  out += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.indices.size() / 3);
  for (size_t v = 0; v < mesh.positions.size(); ++v) {
    for (int a = 0; a < 3; ++a) out += raw(mesh.positions[v][a], big_endian);
    for (const int shift : {16, 8, 0})
      if (!mesh.colours.empty()) out += static_cast<char>(mesh.colours[v] >> shift & 255);
    if (more) out += raw(static_cast<float>(v), big_endian);
  }
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    out += '\3';
    for (size_t k = 0; k < 3; ++k) out += raw(static_cast<int32_t>(mesh.indices[i + k]), big_endian);
  }
  return out;
}

std::shared_ptr<const RandomMesh> random_mesh(const TempFolder& folder, const std::string& content,
                                              const std::string& array = "") {
  const auto file = MappedFile::open(folder.write("mesh.ply", content));
  auto out = random_ply(*file, "mesh.ply", array);
  EXPECT_TRUE(out.ok());
  return out ? *out : nullptr;
}

// Triangles of a store, each as the bytes of its corners: place, normal, colour.
using Triangle = std::array<std::array<uint32_t, 5>, 3>;
std::vector<Triangle> triangles_of(const StoreContent& store) {
  std::vector<Triangle> out;
  for (const geometry::ChunkInfo& info : store.chunks) {
    if (!info.is_leaf()) break;
    const auto held = *geometry::decode_chunk(store.chunk(info.id.value));
    const geometry::MeshChunkView& chunk = held.view;
    for (size_t t = 0; t < chunk.triangles(); ++t) {
      Triangle& triangle = out.emplace_back();
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t v = chunk.indices[3 * t + k];
        std::memcpy(triangle[k].data(), &chunk.positions_room[3 * size_t{v}], 12);
        triangle[k][3] = chunk.normals[v], triangle[k][4] = chunk.colours[v];
      }
      std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

class OutOfCore : public testing::Test {
 protected:
  // Parts of about 3200 triangles, in four leaves.
  Result<bool> write(const RandomMesh& mesh, MeshStoreInfo& info) {
    file_ = Descriptor::open_file(folder_ / "parts.mesh", O_RDWR | O_CREAT | O_TRUNC);
    StorePlace place{file_.get(), folder_ / ""};
    return write_out_of_core(place, "mesh.ply", mesh, options(), info, nothing);
  }
  OutOfCoreOptions options() const {
    return {.store = {{.room_size_m = 1, .up = "z"}}, .leaf_triangles = 1000, .leaves = 4};
  }
  StoreContent written() const { return *read_store(file_.get(), "parts.mesh"); }
  StoreContent whole(const Mesh& mesh) const {
    const auto placed = place_mesh(Mesh(mesh), options().store, "mesh.ply");
    const auto file = Descriptor::open_file(folder_ / "whole.mesh", O_RDWR | O_CREAT | O_TRUNC);
    MeshStoreInfo info;
    info.box_room = placed->box_room, info.triangles = placed->indices.size() / 3;
    EXPECT_TRUE(write_store(file.get(), "mesh.ply", *placed, info, nothing).ok());
    return *read_store(file.get(), "whole.mesh");
  }

  TempFolder folder_;
  Descriptor file_;
};

TEST_F(OutOfCore, HoldsTheSameTrianglesNormalsAndColoursAsTheWholeMesh) {
  const Mesh mesh = wavy_grid(128, 3.0);  // steep: many vertices have several normals
  MeshStoreInfo info;
  ASSERT_TRUE(*write(*random_mesh(folder_, binary_ply(mesh)), info));
  const StoreContent parts = written();
  EXPECT_GT(parts.chunks.size(), 40u);
  EXPECT_EQ(info.triangles, 2u * 128 * 128);
  EXPECT_EQ(triangles_of(parts), triangles_of(whole(mesh)));
}

TEST_F(OutOfCore, LeavesLieInTheRoomAsThoseOfTheWholeMesh) {
  const Mesh mesh = wavy_grid(90);
  MeshStoreInfo info;
  ASSERT_TRUE(*write(*random_mesh(folder_, binary_ply(mesh, true)), info));
  const auto placed = place_mesh(Mesh(mesh), options().store, "mesh.ply");
  EXPECT_EQ(info.box_room, placed->box_room);
  EXPECT_EQ(info.box_data, placed->box_data);
  EXPECT_EQ(info.up, "z");
}

TEST_F(OutOfCore, LeavesOutWhatIsNotFiniteOrHasNoArea) {
  Mesh mesh = wavy_grid(80);
  const auto last = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.emplace_back(kNan, 0, 0), mesh.colours.push_back(0);
  mesh.indices.insert(mesh.indices.end(), {0, 1, last, 5, 5, 6});
  MeshStoreInfo info;
  ASSERT_TRUE(*write(*random_mesh(folder_, binary_ply(mesh)), info));
  EXPECT_EQ(info.triangles, 2u * 80 * 80);
  EXPECT_EQ(info.degenerate_dropped, 1u);
  ASSERT_EQ(info.notes.size(), 1u);
  EXPECT_EQ(info.notes[0], "1 of 12802 triangles are left out: a coordinate of theirs is no finite number");
}

TEST_F(OutOfCore, NamesATriangleWhoseVertexDoesNotExist) {
  Mesh mesh = wavy_grid(80);
  mesh.indices[3 * 700 + 1] = 9000;
  MeshStoreInfo info;
  const auto made = write(*random_mesh(folder_, binary_ply(mesh)), info);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().text, "mesh.ply: triangle 700 names vertex 9000, there are 6561");
}

TEST_F(OutOfCore, LeavesTangledMeshesToThoseWhoReadThemWhole) {
  Mesh mesh = wavy_grid(80);
  std::mt19937 random(3);
  std::shuffle(mesh.indices.begin(), mesh.indices.end(), random);
  MeshStoreInfo info;
  const auto made = write(*random_mesh(folder_, binary_ply(mesh)), info);
  ASSERT_TRUE(made.ok());
  EXPECT_FALSE(*made);
}

TEST_F(OutOfCore, HoldsTheSameTrianglesOfARasterWithHoles) {
  ElevationRaster raster;
  raster.width = 120, raster.height = 110;
  for (int i = 0; i < 120 * 110; ++i)
    raster.heights.push_back(i % 97 == 5 ? float(kNan) : float(3 * std::sin(0.1 * (i % 120)) * std::cos(0.002 * i)));
  raster.notes = {"mesh.ply: a remark"};
  const Mesh mesh = *elevation_mesh(ElevationRaster(raster), {}, "mesh.ply");
  MeshStoreInfo info;
  ASSERT_TRUE(*write(**ElevationGrid::make(raster, {}, "mesh.ply"), info));
  EXPECT_EQ(info.vertices, mesh.positions.size());
  EXPECT_EQ(info.triangles, mesh.indices.size() / 3);
  EXPECT_EQ(info.notes, std::vector<std::string>{"a remark"});
  EXPECT_EQ(triangles_of(written()), triangles_of(whole(mesh)));
}

TEST_F(OutOfCore, HoldsTheValuesOfAnArray) {
  const Mesh mesh = wavy_grid(16);
  const auto random = random_mesh(folder_, binary_ply(mesh, false, true), "heat");
  ASSERT_EQ(random->facts().arrays.size(), 1u);
  EXPECT_EQ(random->facts().arrays[0].spans[0], (scene::ValueSpan{0, 288}));
  MeshStoreInfo info;
  ASSERT_TRUE(*write(*random, info));
  auto coloured = read_mesh(folder_ / "mesh.ply", {}, {}, "heat");
  EXPECT_EQ(triangles_of(written()), triangles_of(whole(*coloured)));
}

TEST(RandomPly, IsReadAsTheWholeFileIs) {
  const TempFolder folder;
  const Mesh mesh = wavy_grid(8);
  for (const bool big_endian : {false, true}) {
    const auto random = random_mesh(folder, binary_ply(mesh, big_endian));
    ASSERT_TRUE(random);
    ASSERT_EQ(random->triangles(), mesh.indices.size() / 3);
    std::vector<uint32_t> corners(mesh.indices.size());
    EXPECT_TRUE(random->corners(0, random->triangles(), corners.data()));
    EXPECT_EQ(corners, mesh.indices);
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
      EXPECT_EQ(random->position(v), mesh.positions[v]);
      EXPECT_EQ(random->colour(v), mesh.colours[v]);
    }
  }
}

TEST(RandomPly, IsLeftToTheReaderUnlessAllFacesAreTriangles) {
  const TempFolder folder;
  EXPECT_FALSE(random_mesh(folder, ply_of(wavy_grid(4)))) << "text";
  std::string cut = binary_ply(wavy_grid(4));
  EXPECT_FALSE(random_mesh(folder, cut + "more"));
  cut[cut.size() - 13] = '\4';
  const auto random = random_mesh(folder, cut);
  ASSERT_TRUE(random);
  EXPECT_FALSE(*survey(*random, "mesh.ply", [](double) {})) << "one face has four corners";
}

TEST(PartTree, HasPartsOfEqualSizeWhoseFoursAreTogether) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(0, 1);
  std::vector<glm::vec3> points(64000);
  for (auto& p : points) p = {4 * place(random), place(random), 0};
  const PartTree tree(points, 16);
  std::vector<size_t> count(16);
  std::vector<geometry::Box> fours(4);
  for (const auto& p : points) ++count[tree.part_of(p)], fours[tree.part_of(p) / 4].extend(p);
  for (const size_t n : count) EXPECT_NEAR(double(n), 4000, 1);
  for (const auto& box : fours) EXPECT_LT(box.size().x * box.size().y, 1.05f);
}

TEST(ScratchLists, GiveBackWhatWasAddedInTurn) {
  const TempFolder folder;
  auto lists = ScratchLists::make(folder / "", 3);
  ASSERT_TRUE(lists.ok());
  for (uint32_t i = 0; i < 100000; ++i) lists->add(i % 7 == 0 ? 2 : 0, i);
  EXPECT_EQ(lists->size(0) + lists->size(2), 100000u);
  const auto sevens = lists->take(2), none = lists->take(1);
  ASSERT_TRUE(sevens.ok() && none.ok());
  for (uint32_t i = 0; i < sevens->size(); ++i) ASSERT_EQ((*sevens)[i], 7 * i);
  EXPECT_EQ(sevens->size(), 14286u);
  EXPECT_TRUE(none->empty());
}

TEST(Preview, CoversTheWholeMeshFromAPartOfItsTriangles) {
  const TempFolder folder;
  const Mesh mesh = wavy_grid(200, 0.8);
  const StoreOptions options{{.room_size_m = 1, .up = "z"}};
  const auto made = make_preview("mesh.ply", *random_mesh(folder, binary_ply(mesh)),
                                 {.store = options, .array = "", .most_triangles = 20000, .most_s = 1e9});
  ASSERT_TRUE(made.ok()) << made.error().text;
  const auto placed = place_mesh(Mesh(mesh), options, "mesh.ply");
  EXPECT_EQ((*made)->info().box_data, placed->box_data);
  // Every vertex of the mesh lies near a square's middle: at most a cell and its height away.
  std::vector<glm::vec3> middles;
  for (const auto& info : (*made)->leaves()) {
    const auto held = *geometry::decode_chunk((*made)->chunk(info.id).bytes);
    const geometry::MeshChunkView& chunk = held.view;
    for (size_t i = 0; i < chunk.indices.size(); i += 3) {
      glm::vec3 sum(0);
      for (size_t k = 0; k < 3; ++k) {
        const float* p = &chunk.positions_room[3 * size_t{chunk.indices[i + k]}];
        sum += glm::vec3(p[0], p[1], p[2]) / 3.0f;
      }
      middles.push_back(sum);
    }
  }
  for (size_t v = 0; v < placed->positions_room.size(); v += 37) {
    const glm::vec3 p = placed->positions_room[v];
    const bool near =
        std::any_of(middles.begin(), middles.end(), [&](const glm::vec3& m) { return glm::distance(m, p) < 0.04f; });
    EXPECT_TRUE(near) << p.x << " " << p.y << " " << p.z;
  }
}

}  // namespace
}  // namespace telesplat::data::test
