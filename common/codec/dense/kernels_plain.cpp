#include <bit>
#include <cstring>

#include "common/codec/dense/kernels.h"

#define RESTRICT __restrict

namespace telesplat::codec::detail {
namespace {

#include "common/codec/dense/kernels-inl.h"
#include "common/codec/dense/rans-inl.h"

static void CoveredBits(const uint32_t* depth, size_t n, uint64_t* words) {
  for (size_t x = 0; x < n; x += 64) {
    uint64_t word = 0;
    for (size_t i = 0; i < 64 && x + i < n; ++i) word |= uint64_t{depth[x + i] != 0} << i;
    words[x / 64] = word;
  }
}

static void CoverBytes(const uint64_t* words, size_t n, uint8_t* cover) {
  for (size_t x = 0; x < n; ++x) cover[x] = static_cast<uint8_t>(0 - (words[x / 64] >> x % 64 & 1));
}

static void NormalEquations(const float (*features)[kFeatures], const float* weights, size_t n,
                            float (*sums)[kFeatures]) {
  for (int i = 0; i < kFeatures; ++i)
    for (int j = 0; j <= i; ++j) {
      float sum = 0;
      for (size_t s = 0; s < n; ++s) sum += features[s][i] * (features[s][j] * weights[s]);
      sums[i][j] = sum;
    }
}

static void SampleShares(const float (*features)[kFeatures], const float* terms, size_t n, float least, bool squared,
                         float* shares) {
  for (size_t s = 0; s < (n + 3) / 4 * 4; ++s) {
    float parts[4] = {};
    for (int i = 0; i < kFeatures; ++i) parts[i % 4] = parts[i % 4] + terms[i] * features[s][i];
    const float off = (parts[0] + parts[1]) + (parts[2] + parts[3]), size = least + (off < 0 ? -off : off);
    shares[s] = 1 / (squared ? size * size : size);
  }
}

}  // namespace

const Kernels& plain_kernels() {
  static constexpr Kernels all{CoveredBits,
                               CoverBytes,
                               CutWide,
                               CutShort,
                               Pack<uint8_t>,
                               Pack<uint16_t>,
                               Pack<uint32_t>,
                               Unpack<uint8_t>,
                               UnpackWide,
                               KeepBytes,
                               FillValues,
                               Within,
                               LargestLessOne,
                               DepthResiduals,
                               DepthRows,
                               PlaneResiduals,
                               PlaneTerms,
                               PlaneKinds,
                               PlaneContexts,
                               Contexts,
                               JoinBytes,
                               OtherNormals,
                               TurnNormals,
                               TurnNormalsBack,
                               Divide,
                               UnfoldBytes,
                               UnfoldWide,
                               MedianResiduals,
                               GuidedResiduals<GuidedSums>,
                               GuidedResidualsWide<GuidedSums>,
                               MedianValues,
                               GuidedSums,
                               Flatness,
                               Geometry,
                               Heights,
                               Knots,
                               Activity,
                               NormalEquations,
                               SampleShares,
                               PlainSlots,
                               PlainPutSymbols,
                               PlainGetSymbols};
  return all;
}

#ifdef TELESPLAT_CODEC_PLAIN
const Kernels& kernels() { return plain_kernels(); }
std::vector<int64_t> kernel_targets() { return {}; }
#endif

}  // namespace telesplat::codec::detail
