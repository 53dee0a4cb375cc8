#include "services/packer/points/plan/view/judge_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "services/packer/points/plan/view/judge_rows.cpp"
#include <hwy/foreach_target.h>  // compiles what follows once a target

#include <hwy/highway.h>

#include "services/packer/points/plan/view/judge_rows-inl.h"

#if HWY_ONCE
namespace telesplat::packer {

HWY_EXPORT(SplitRow);
HWY_EXPORT(CompareRows);
HWY_EXPORT(JudgeRow64);
HWY_EXPORT(WriteRow);

BiasTable bias_table(const splat::RimBias& rim) {
  BiasTable out{};
  for (uint32_t i = 0; i < out.size(); ++i) out[i] = static_cast<int32_t>((rim[i >> 3] * (2 * (i & 7) + 1) + 8) >> 4);
  return out;
}

void split_row(const uint64_t* keys, int first, int last, const BiasTable& bias, const PixelRow& out) {
  HWY_DYNAMIC_DISPATCH(SplitRow)(keys, first, last, bias, out);
}

void compare_rows(const NeighbourRows& rows, int first, int last, int32_t* out) {
  HWY_DYNAMIC_DISPATCH(CompareRows)(rows, first, last, out);
}

RowBits judge_row_64(const ContrastRow& row, float near_m, float farther, int x) {
  return HWY_DYNAMIC_DISPATCH(JudgeRow64)(row, near_m, farther, x);
}

void write_row(const PixelRow& row, float near_m, int last, float* depth_m, uint32_t* colour, uint16_t* normal) {
  HWY_DYNAMIC_DISPATCH(WriteRow)(row, near_m, last, depth_m, colour, normal);
}

}  // namespace telesplat::packer
#endif
