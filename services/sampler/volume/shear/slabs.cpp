#include "services/sampler/volume/shear/slabs.h"

#include "services/sampler/volume/shear/splatter.h"

namespace telesplat::sampler {
namespace {

class ShearSlab final : public Slab {
 public:
  ShearSlab(std::shared_ptr<ShearSplatter> splatter, const volume::Grid& grid, volume::Voxels voxels)
      : splatter_(std::move(splatter)), volume_(grid, std::move(voxels)) {}

  size_t bytes() const override { return volume_.bytes(); }
  std::vector<volume::SliceImage> splat(const std::vector<volume::LevelColour>& colours,
                                        const volume::ShearFrame& frame, int k_begin, int k_end,
                                        const geometry::Clip& clip, uint64_t& voxels) const override {
    ShearStats stats;
    auto images = splatter_->splat(volume_, colours, frame, k_begin, k_end, &stats, clip);
    voxels = stats.voxels;
    return images;
  }

 private:
  std::shared_ptr<ShearSplatter> splatter_;
  SlabVolume volume_;
};

}  // namespace

MakeSlab make_shear_slabs(int threads) {
  return [splatter = std::make_shared<ShearSplatter>(threads)](const volume::Grid& grid, volume::Voxels voxels) {
    return std::make_shared<const ShearSlab>(splatter, grid, std::move(voxels));
  };
}

}  // namespace telesplat::sampler
