// Places of meshes in glTF files: nodes, scenes, instances, skins and morphs.
#include "tests/unit/data/gltf/made.h"

namespace telesplat::data::test {
namespace {

Json tetrahedron(MadeGltf& made) {
  const size_t p = made.accessor(kTetrahedron, 3), i = made.accessor(kFaces, 1);
  return {{"attributes", {{"POSITION", p}}}, {"indices", i}};
}

TEST(GltfScene, TheDefaultIsShownElseTheFirstElseAllRoots) {
  MadeGltf made;
  for (const double x : {0.0, 10.0, 20.0}) made.show(tetrahedron(made), {{"translation", {x, 0, 0}}});
  expect_box(read(made.glb()), 12, {0, 0, 0}, {21, 1, 1});
  made.json["scenes"] = {{{"nodes", {2}}}, {{"nodes", {0, 1}}}};
  expect_box(read(made.glb()), 4, {20, 0, 0}, {21, 1, 1});
  made.json["scene"] = 1;
  expect_box(read(made.glb()), 8, {0, 0, 0}, {11, 1, 1});
  EXPECT_EQ(read(made.glb()).notes, std::vector<std::string>{"a.glb: scenes that are not shown: 1"});
  made.json.erase("scenes");
  made.json["nodes"][0]["children"] = {1, 2};
  made.json["nodes"][0]["scale"] = {2, 2, 2};
  expect_box(read(made.glb()), 12, {0, 0, 0}, {42, 2, 2});
  made.json.erase("nodes");
  EXPECT_EQ(read(made.glb()).indices.size(), 36u) << "without nodes each mesh once";
}

TEST(GltfScene, MirrorsKeepOutsidesOutside) {
  for (const double x : {1.0, -1.0})
    for (const double z : {2.0, -2.0}) {
      MadeGltf made;
      Json primitive = tetrahedron(made);
      primitive["attributes"]["NORMAL"] = made.accessor<float>({-1, -1, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1}, 3);
      made.show(primitive, {{"matrix", {x, 0, 0, 0, 0, 1, 0, 0, 0, 0, z, 0, 0, 0, 0, 1}}});
      const Mesh mesh = read(made.glb());
      EXPECT_NEAR(volume(mesh), 2, 1e-9);
      EXPECT_EQ(mesh.normals[1], glm::vec3(x, 0, 0));
      EXPECT_EQ(mesh.normals[3], glm::vec3(0, 0, z / 2));
    }
}

TEST(GltfScene, InstancesAreShownWhetherRequiredOrNot) {
  for (const bool required : {false, true}) {
    MadeGltf made;
    const size_t t = made.accessor<float>({0, 0, 0, 3, 0, 0, 9, 0, 0}, 3);
    const size_t r = made.accessor<int8_t>({0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 127, 0}, 4, {{"normalized", true}});
    const size_t s = made.accessor<float>({1, 1, 1, 1, 5, 1, 1, 1, 1}, 3);
    const Json lists = {{"TRANSLATION", t}, {"ROTATION", r}, {"SCALE", s}};
    made.show(tetrahedron(made),
              {{"scale", {2, 1, 1}}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", lists}}}}}});
    if (required) made.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    const Mesh mesh = read(made.glb());
    expect_box(mesh, 12, {0, -1, 0}, {18, 5, 1});
    EXPECT_NEAR(volume(mesh), 2 + 10 + 2, 1e-4);
    made.json["accessors"][s]["count"] = 2;
    EXPECT_NE(refusal(made.glb()).find("different lengths"), std::string::npos);
  }
}

// Two joints; the upper one is turned by a quarter. The mesh's own node does not count.
TEST(GltfScene, SkinsAndMorphsStandAtRest) {
  MadeGltf made;
  Json primitive = tetrahedron(made);
  primitive["attributes"]["JOINTS_0"] = made.accessor<uint8_t>({0, 9, 9, 9, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, 4);
  primitive["attributes"]["WEIGHTS_0"] =
      made.accessor<uint8_t>({255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 128, 127, 0, 0}, 4, {{"normalized", true}});
  primitive["targets"] = {{{"POSITION", made.accessor<float>({0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0}, 3)}}};
  made.show(primitive, {{"skin", 0}, {"translation", {100, 0, 0}}, {"weights", {0.5}}});
  made.add("nodes", {{"translation", {0, 0, 5}}, {"children", {2}}});
  made.add("nodes", {{"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}});
  made.json["skins"] = {{{"joints", {1, 2}}}};
  const Mesh mesh = read(made.glb());
  ASSERT_EQ(mesh.positions.size(), 4u);
  EXPECT_LT(glm::distance(mesh.positions[0], glm::dvec3(0, 0, 5)), 1e-6);
  EXPECT_LT(glm::distance(mesh.positions[1], glm::dvec3(2, 0, 5)), 1e-6) << "moved by half of its target";
  EXPECT_LT(glm::distance(mesh.positions[2], glm::dvec3(-1, 0, 5)), 1e-6) << "turned";
  EXPECT_LT(glm::distance(mesh.positions[3], glm::dvec3(0, 0, 6)), 1e-6);
  made.json["animations"] = Json::array({Json::object()});
  EXPECT_NE(read(made.glb()).notes.at(0).find("animations are not played: 1"), std::string::npos);
  made.json["skins"][0]["joints"] = {1};
  EXPECT_NE(refusal(made.glb()).find("names joint 1, its skin has 1"), std::string::npos);
}

TEST(GltfScene, NodesThatAreNoTreeAreRefused) {
  MadeGltf made;
  made.show(tetrahedron(made));
  for (int i = 0; i < 2; ++i) made.add("nodes", Json::object());
  auto& nodes = made.json["nodes"];
  nodes[1]["children"] = {0};
  nodes[2]["children"] = {0};
  EXPECT_NE(refusal(made.glb()).find("node 0 has two parents, 1 and 2"), std::string::npos);
  nodes[2].erase("children");
  nodes[0]["children"] = {1};
  made.json["scenes"] = {{{"nodes", {0}}}};
  EXPECT_NE(refusal(made.glb()).find("node 0 lies below itself"), std::string::npos);
  nodes[0]["children"] = {77};
  EXPECT_NE(refusal(made.glb()).find("names node 77, there are 3"), std::string::npos);
}

TEST(GltfScene, ChainsOfNodesMayBeLong) {
  MadeGltf made;
  made.show(tetrahedron(made));
  constexpr size_t kNodes = 100'000;
  for (size_t i = 1; i < kNodes; ++i) made.add("nodes", {{"children", {i - 1}}, {"translation", {1, 0, 0}}});
  made.json["scenes"] = {{{"nodes", {kNodes - 1}}}};
  expect_box(read(made.glb()), 4, {kNodes - 1, 0, 0}, {kNodes, 1, 1});
}

TEST(GltfScene, InstancesHaveALimit) {
  MadeGltf made;
  const size_t p = made.accessor(std::vector<float>(3 * 9000), 3), t = made.accessor(std::vector<float>(3 * 9000), 3);
  made.show({{"attributes", {{"POSITION", p}}}},
            {{"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", t}}}}}}}});
  EXPECT_NE(refusal(made.glb()).find("9000 vertices in 9000 places"), std::string::npos);
}

TEST(GltfScene, ClaimsAreRefusedBeforeTheyCost) {
  MadeGltf made;
  Json primitive = tetrahedron(made);
  made.show(primitive);
  made.json["accessors"][0].update({{"count", 4'000'000'000u}});
  EXPECT_NE(refusal(made.glb()).find("claims 4000000000 elements"), std::string::npos);
  made.json["accessors"][0].erase("bufferView");
  EXPECT_NE(refusal(made.glb()).find("claims 4000000000 elements"), std::string::npos);
  made.json["accessors"][0].update({{"count", 3}, {"bufferView", 0}});
  EXPECT_NE(refusal(made.glb()).find("names vertex 3, there are 3"), std::string::npos);
  made.json["accessors"][0].update({{"count", 4}, {"byteOffset", ~uint64_t{0} - 3}});
  EXPECT_NE(refusal(made.glb()).find("exceed"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::data::test
