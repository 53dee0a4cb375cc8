// Still pictures by both renderers: against 16 rays a pixel, and against a committed picture. To accept a new picture,
// look at it and run with TELESPLAT_UPDATE_GOLDEN=1.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>

#include "client/viewer/render/renderer.h"
#include "common/gl/egl_context.h"
#include "tests/support/still_scene.h"

namespace telesplat::viewer {
namespace {

constexpr int kWidth = 264, kHeight = 165, kTile = 64;

geometry::Camera display() { return test::scene_camera({0.35, 0.3, 0.5}, kWidth, kHeight); }

struct Pictures {
  image::View plain, still;
  int drawn = 0, tiles = 0;
};

// A model, and the finer rays that it was made from.
struct Sampled {
  points::PointModel model;
  std::unique_ptr<FineRays> rays = std::make_unique<FineRays>();
};

Pictures draw(Renderer& renderer, const Sampled& sampled, splat::Kernel kernel, int side, int tile = kTile) {
  const points::PointModel& model = sampled.model;
  const geometry::Camera camera = display();
  const image::Shading shading({}, camera);
  splat::SelectionOptions selection;
  selection.scale = splat::suitable_scale(kernel);
  const splat::RenderOptions options{kernel, {}};
  splat::DrawList list;
  splat::select_view(model, camera, selection, list);
  Pictures out;
  out.plain = {kWidth, kHeight, std::vector<uint32_t>(size_t{kWidth} * kHeight), {}};
  renderer.render(list, camera, options, shading, {kWidth, kHeight, out.plain.colour.data(), nullptr});
  out.still = out.plain;
  Supersampler supersampler(renderer, side);
  const Supersampler::Scene scene{[&](const geometry::Camera& c, const splat::SelectionOptions& o, splat::DrawList& l) {
                                    splat::select_view(model, c, o, l);
                                  },
                                  selection, options, shading, sampled.rays.get()};
  for (int y = 0; y < kHeight; y += tile)
    for (int x = 0; x < kWidth; x += tile) {
      const geometry::Rect rect{x, y, std::min(tile, kWidth - x), std::min(tile, kHeight - y)};
      out.drawn += supersampler.draw(scene, camera, rect, &out.still.colour[size_t(y) * kWidth + x], kWidth);
      ++out.tiles;
    }
  return out;
}

points::ModelConfig compact_config() {
  points::ModelConfig config = test::scene_config();
  config.compact = true;
  return config;
}

// Adds the display's picture with `by` times as many rays a side; `cast` chooses those that are cast.
template <class Cast>
void add(Sampled& to, uint64_t sequence, int by, const Cast& cast) {
  const test::CastRays rays = test::cast_rays(display(), by, cast);
  if (by > 1) to.rays->add(rays.tile({}));
  to.model.insert(rays.patch(to.model.config(), sequence));
}

Sampled model_of(std::initializer_list<int> scales) {
  Sampled out{points::PointModel(compact_config())};
  uint64_t sequence = 0;
  for (const int by : scales) add(out, ++sequence, by, [](int, int) { return true; });
  return out;
}

// Returns null, with the reason, on a machine without OpenGL.
std::unique_ptr<Renderer> make(const std::string& kind, std::string& why_not) {
  if (kind == "gl")
    if (const auto context = gl::EglContext::make(); !context) {
      why_not = context.error().text;
      return nullptr;
    }
  auto made = make_renderer(kind, 2);
  if (made) return std::move(*made);
  ADD_FAILURE() << made.error().text;
  return nullptr;
}

class StillPictures : public ::testing::TestWithParam<std::tuple<std::string, splat::Kernel>> {
 protected:
  void SetUp() override {
    const auto& [kind, kernel] = GetParam();
    std::string why_not;
    renderer_ = make(kind, why_not);
    kernel_ = kernel;
    if (!renderer_) GTEST_SKIP() << why_not;
  }
  std::unique_ptr<Renderer> renderer_;
  splat::Kernel kernel_{};
};

TEST_P(StillPictures, ApproachSixteenRaysAPixel) {
  const image::View reference = test::traced(display(), 4, image::Shading({}, display()));
  double before = 0;
  for (const auto scales : {std::initializer_list<int>{1}, {1, 2}, {1, 2, 4}, {4}}) {
    const Pictures p = draw(*renderer_, model_of(scales), kernel_, 4);
    const double plain = test::psnr_db(p.plain, reference), still = test::psnr_db(p.still, reference);
    const int finest = *std::max_element(scales.begin(), scales.end());
    std::printf("samples up to %dx%d a pixel, %zu times: %.2f dB, with sub-pixels %.2f dB, %d of %d tiles\n", finest,
                finest, scales.size(), plain, still, p.drawn, p.tiles);
    if (finest == 1) {
      EXPECT_EQ(p.drawn, 0) << "samples a pixel apart say nothing of sub-pixels";
    } else {
      EXPECT_GT(still, plain + 2);
      EXPECT_GE(still, before - 0.5) << "more samples are no worse";
      before = still;
    }
    if (finest == 4) {
      EXPECT_GT(still, 55);
    }
  }
}

// A refinement half way: clumps of finer samples among those a pixel apart, in merged mosaics.
TEST_P(StillPictures, HaveNoHolesWhereFineAndCoarseSamplesMix) {
  Sampled model = model_of({1});
  uint64_t sequence = 1;
  for (const int by : {2, 4, 2, 4, 4}) {
    std::mt19937 random(static_cast<uint32_t>(++sequence));
    const int clump = 3 * by, columns = kWidth * by / clump + 1;
    std::vector<bool> kept(static_cast<size_t>(columns) * (kHeight * by / clump + 1));
    for (size_t i = 0; i < kept.size(); ++i) kept[i] = random() % 100 < 15;
    add(model, sequence, by, [&](int x, int y) { return kept[static_cast<size_t>(y / clump * columns + x / clump)]; });
  }
  const image::View reference = test::traced(display(), 4, image::Shading({}, display()));
  const Pictures p = draw(*renderer_, model, kernel_, 4);
  const double plain = test::psnr_db(p.plain, reference), still = test::psnr_db(p.still, reference);
  std::printf("%d of %d tiles drawn: %.2f dB, with sub-pixels %.2f dB\n", p.drawn, p.tiles, plain, still);
  EXPECT_GT(still, 38) << "with holes it has 31 or less";
  EXPECT_GT(still, plain + 1);
}

// Some samples are missing, with nothing behind them; some samples are finer. A gap of a few sub-pixels is no
// silhouette, at which only finer samples would count.
TEST_P(StillPictures, HaveNoDotsWhereSamplesAreMissing) {
  Sampled model{points::PointModel(compact_config())};
  std::mt19937 random(7);
  add(model, 1, 1, [&](int, int) { return random() % 100 >= 3; });
  add(model, 2, 4, [&](int, int) { return random() % 100 >= 80; });
  const Pictures p = draw(*renderer_, model, kernel_, 4);
  const Pictures whole = draw(*renderer_, model_of({4}), kernel_, 4);
  const uint32_t background = image::Shading({}, display()).background() & 0xffffff;
  const auto shows_nothing = [&](int x, int y) {
    return (whole.still.colour[size_t(y) * kWidth + size_t(x)] & 0xffffff) == background;
  };
  int inside = 0, dots = 0;
  for (int y = 3; y < kHeight - 3; ++y)
    for (int x = 3; x < kWidth - 3; ++x) {
      bool near_nothing = false;
      for (int j = -3; j <= 3; ++j)
        for (int i = -3; i <= 3; ++i) near_nothing |= shows_nothing(x + i, y + j);
      if (near_nothing) continue;
      ++inside;
      const size_t at = size_t(y) * kWidth + size_t(x);
      int worst = 0;
      for (const int shift : {16, 8, 0})
        worst = std::max(worst,
                         std::abs(int(p.still.colour[at] >> shift & 255) - int(whole.still.colour[at] >> shift & 255)));
      dots += worst > 60;
    }
  std::printf("%d of %d tiles drawn: %d dots in %d pixels\n", p.drawn, p.tiles, dots, inside);
  EXPECT_GT(inside, 5000);
  EXPECT_LE(dots, inside / 1000) << "as silhouettes they would be a tenth";
}

TEST_P(StillPictures, HaveNoSeams) {
  const Sampled model = model_of({1, 4});
  const Pictures tiles = draw(*renderer_, model, kernel_, 4), whole = draw(*renderer_, model, kernel_, 4, kWidth);
  EXPECT_EQ(whole.drawn, 1);
  size_t differ = 0;
  for (size_t i = 0; i < whole.still.colour.size(); ++i) differ += tiles.still.colour[i] != whole.still.colour[i];
  // A point's place within a sub-pixel is rounded to 1/8, and each frame rounds it differently.
  EXPECT_LT(double(differ), 0.03 * double(whole.still.colour.size()));
  EXPECT_GT(test::psnr_db(tiles.still, whole.still), 55);
}

// Samples 6 pixels apart would need splats of 26 sub-pixels; the largest splat has 16.
TEST_P(StillPictures, HaveNoGapsWhereSamplesAreFarApart) {
  const points::ModelConfig config = test::scene_config();
  const image::View reference = test::traced(display(), 4, image::Shading({}, display()));
  const auto patch = [&](uint64_t sequence, const geometry::Camera& camera, const geometry::Rect& rect) {
    return points::prepare_patch(config, Sequence{sequence}, camera, rect, test::sample_scene(camera, rect),
                                 FrameId{sequence});
  };
  geometry::Camera coarse = display();
  coarse.width /= 6, coarse.height /= 6;
  const geometry::Camera fine = test::finer(display(), 4);
  // Fine samples in a narrow strip across the middle, then everywhere except in a corner.
  for (const geometry::Rect& there :
       {geometry::Rect{0, fine.height / 2, fine.width, 16}, {fine.width / 8, 0, 7 * fine.width / 8, fine.height}}) {
    Sampled model{points::PointModel(config)};
    model.model.insert(patch(1, coarse, {0, 0, coarse.width, coarse.height}));
    model.model.insert(patch(2, fine, there));
    const Pictures p = draw(*renderer_, model, kernel_, 4);
    const double plain = test::psnr_db(p.plain, reference), still = test::psnr_db(p.still, reference);
    std::printf("%d of %d tiles drawn: %.2f dB, with sub-pixels %.2f dB\n", p.drawn, p.tiles, plain, still);
    EXPECT_GT(still, plain - 0.2);
    EXPECT_EQ(p.drawn > 0, there.height > 16) << "a strip makes no tile fine";
  }
}

// The properties above hold for any kernel in OpenGL; these tests draw each kernel.
class CommittedStillPictures : public StillPictures {};

TEST_P(CommittedStillPictures, LookAlike) {
  const std::string kernel(splat::kernel_name(kernel_)), path = "tests/golden/images/still-" + kernel + ".png";
  image::View drawn = draw(*renderer_, model_of({1, 2, 4}), kernel_, 4).still;
  for (uint32_t& c : drawn.colour) c &= 0xffffff;
  if (std::getenv("TELESPLAT_UPDATE_GOLDEN") && std::get<0>(GetParam()) == "cpu") {
    ASSERT_TRUE(image::write_png(path, drawn).ok());
  }
  const auto reference = image::read_view(path);
  ASSERT_TRUE(reference) << reference.error().text;
  ASSERT_EQ(reference->width, kWidth);
  const double psnr = test::psnr_db(*reference, drawn);
  if (!(psnr > 50)) (void)image::write_png(std::string(TELESPLAT_GOLDEN_OUT) + "/still-" + kernel + ".png", drawn);
  EXPECT_GT(psnr, 50) << "the picture lies in " << TELESPLAT_GOLDEN_OUT;
}

const auto kName = [](const auto& info) {
  return std::get<0>(info.param) + "_" + std::string(splat::kernel_name(std::get<1>(info.param)));
};
INSTANTIATE_TEST_SUITE_P(Cpu, StillPictures,
                         ::testing::Combine(::testing::Values("cpu"), ::testing::ValuesIn(splat::kKernels)), kName);
INSTANTIATE_TEST_SUITE_P(Gl, StillPictures,
                         ::testing::Combine(::testing::Values("gl"), ::testing::Values(splat::Kernel::kEllipse)),
                         kName);
INSTANTIATE_TEST_SUITE_P(Renderers, CommittedStillPictures,
                         ::testing::Combine(::testing::Values("cpu", "gl"), ::testing::ValuesIn(splat::kKernels)),
                         kName);

}  // namespace
}  // namespace telesplat::viewer
