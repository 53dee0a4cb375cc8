#include <bit>
#include <cstring>

#include "common/codec/dense/kernels.h"

#define RESTRICT __restrict

namespace telesplat::codec::detail {
namespace {

#include "common/codec/dense/kernels-inl.h"
#include "common/codec/dense/rans-inl.h"

static void NormalEquations(const float (*features)[kFeatures], const float* weights, size_t n,
                            float (*sums)[kFeatures]) {
  for (int i = 0; i < kFeatures; ++i)
    for (int j = 0; j <= i; ++j) {
      float sum = 0;
      for (size_t s = 0; s < n; ++s) sum += features[s][i] * weights[s] * features[s][j];
      sums[i][j] = sum;
    }
}

}  // namespace

const Kernels& plain_kernels() {
  static constexpr Kernels all{DepthResiduals,  DepthRows,       PlaneResiduals,      PlaneTerms,      Contexts,
                               MedianResiduals, GuidedResiduals, GuidedResidualsWide, GuidedSums,      Geometry,
                               Heights,         Activity,        NormalEquations,     PlainPutSymbols, PlainGetSymbols};
  return all;
}

#ifdef TELESPLAT_CODEC_PLAIN
const Kernels& kernels() { return plain_kernels(); }
#endif

}  // namespace telesplat::codec::detail
