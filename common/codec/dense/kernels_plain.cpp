#include <bit>
#include <cstring>

#include "common/codec/dense/kernels.h"

#define RESTRICT __restrict

namespace telesplat::codec::detail {
namespace {

#include "common/codec/dense/kernels-inl.h"
#include "common/codec/dense/rans-inl.h"

}  // namespace

const Kernels& plain_kernels() {
  static constexpr Kernels all{DepthResiduals, DepthRows, PlaneResiduals, PlaneTerms, Contexts, MedianResiduals, GuidedResiduals, GuidedResidualsWide, GuidedSums,
                               Geometry, Heights, Activity, NormalEquations,  PlainPutSymbols, PlainGetSymbols};
  return all;
}

#ifdef TELESPLAT_CODEC_PLAIN
const Kernels& kernels() { return plain_kernels(); }
#endif

}  // namespace telesplat::codec::detail
