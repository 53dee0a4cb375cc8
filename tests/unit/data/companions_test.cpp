// Files that a data set's files name: a server reads those below their folder, and others only if an option allows it.
#include "services/data/kinds.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

namespace fs = std::filesystem;

struct Named {
  std::string name, file, begin, end;  // the file's text is begin, the name in it, end
};

const std::string kVoxels(8, '\1');
const std::vector<Named> kNaming{
    {"NrrdVoxels", "a.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: ", "\n"},
    {"MetaImageVoxels", "a.mhd",
     "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = ", "\n"},
    {"ObjMaterials", "a.obj", "mtllib ", "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
    {"GltfBuffer", "a.gltf", R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 8, "uri": ")", R"("}]})"},
    {"PlyPicture", "a.ply", "ply\nformat ascii 1.0\ncomment TextureFile ",
     "\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n"},
    {"VrtSource", "a.vrt",
     "<VRTDataset rasterXSize=\"2\" rasterYSize=\"2\"><VRTRasterBand><SimpleSource><SourceFilename "
     "relativeToVRT=\"1\">",
     "</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>"},
    {"VtkPiece", "a.pvtu",
     "<VTKFile type='PUnstructuredGrid' version='1.0'><PUnstructuredGrid GhostLevel='0'><Piece Source='",
     "'/></PUnstructuredGrid></VTKFile>"},
    {"GltfImage", "a.gltf", R"({"asset": {"version": "2.0"}, "images": [{"uri": ")", R"("}]})"},
};

class Companions : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder / "data/below");
    fs::create_directories(folder / "secret");
    for (const char* at : {"data/own", "data/below/own", "secret/other"}) folder.write(at, kVoxels);
    fs::create_symlink(folder / "secret/other", folder / "data/link");
    fs::create_symlink("own", folder / "data/link-below");
  }
  Status check(const Named& n, const std::string& name, const std::string& companions = "folder") {
    DataOptions o;
    o.scene = folder.write("data/" + n.file, n.begin + name + n.end);
    o.companions = companions;
    return check_companions(o);
  }
  const TempFolder folder;
};

TEST_F(Companions, BelowTheFolderAreRead) {
  for (const Named& n : kNaming)
    for (const std::string& name :
         {std::string("own"), std::string("./own"), std::string("below/own"), std::string("below/../own"),
          std::string("link-below"), folder / "data/own", std::string("missing"), std::string("../missing")}) {
      const Status s = check(n, name);
      EXPECT_TRUE(s) << n.name << " " << name << ": " << s.error().text;
    }
}

TEST_F(Companions, ElsewhereAreRefused) {
  for (const Named& n : kNaming)
    for (const std::string& name : {folder / "secret/other", std::string("../secret/other"), std::string("link"),
                                    std::string("below/../../secret/other")}) {
      const Status s = check(n, name);
      ASSERT_FALSE(s) << n.name << " " << name;
      EXPECT_TRUE(s.error().text.starts_with(folder / ("data/" + n.file) + ": names ")) << s.error().text;
      EXPECT_NE(s.error().text.find("--companions anywhere"), std::string::npos) << s.error().text;
      EXPECT_TRUE(check(n, name, "anywhere")) << n.name << " " << name;
    }
}

TEST_F(Companions, TexturesOfMaterialsCountToo) {
  folder.write("data/a.mtl", "newmtl a\nmap_Kd ../secret/other\n");
  EXPECT_FALSE(check(kNaming[2], "a.mtl"));
  folder.write("data/a.mtl", "newmtl a\nmap_Kd below\\own\n");
  EXPECT_TRUE(check(kNaming[2], "a.mtl"));
}

TEST_F(Companions, OfASeriesAndOfASurfaceAreLookedAt) {
  const Named& n = kNaming[0];
  DataOptions o;
  o.scene = folder / "series";
  fs::create_directories(o.scene);
  folder.write("series/own", kVoxels);
  for (int step = 0; step < 3; ++step)
    folder.write(fmt::format("series/s{}.nhdr", step), n.begin + (step < 2 ? "own" : "../secret/other") + n.end);
  EXPECT_FALSE(check_companions(o));
  folder.write("series/s2.nhdr", n.begin + "own" + n.end);
  EXPECT_TRUE(check_companions(o));
  DataOptions iso;
  iso.scene = folder.write("data/a.nhdr", n.begin + "../secret/other" + n.end);
  iso.mesh.iso = 0.5;
  EXPECT_FALSE(check_companions(iso));
}

// Names in a linked header count from the link's folder: data/other, not secret/other. A scene without a file passes.
TEST_F(Companions, ALinkToAHeaderCountsWhereItLies) {
  const Named& n = kNaming[0];
  folder.write("secret/a.nhdr", n.begin + "other" + n.end);
  fs::create_symlink(folder / "secret/a.nhdr", folder / "data/b.nhdr");
  DataOptions o;
  o.scene = folder / "data/b.nhdr";
  EXPECT_TRUE(check_companions(o)) << "data/other is missing: the reader tells";
  o.scene = "julia";
  EXPECT_TRUE(check_companions(o));
}

}  // namespace
}  // namespace telesplat::data::test
