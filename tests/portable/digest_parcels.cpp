// Decodes parcels (parcels.h) from its standard input with the portable part of the codec, and prints a line for each:
// its number, its kind, the digest of the result, and if that equals the digest in the parcel. Built for the host and
// for WebAssembly from the same list of sources.
#include <cstdio>

#include "common/codec/depth_codec.h"
#include "common/codec/golomb.h"
#include "tests/portable/parcels.h"

namespace telesplat::portable {
namespace {

using namespace codec::detail;

struct Parcel {
  Kind kind;
  const uint8_t *begin, *end;
  uint64_t digest;
};

uint64_t golomb(const Parcel& p) {
  const uint8_t* at = p.begin;
  const auto count = take<uint32_t>(at), expected = take<uint32_t>(at);
  BitReader bits;
  bits.start({at, p.end}, size_t{count} * GolombContext::kMostBits);
  GolombContext context;
  context.start(expected);
  Digest digest;
  for (uint32_t i = 0; i < count; ++i) digest.add(static_cast<uint32_t>(context.get(bits.source)));
  return bits.finished() ? digest.value() : 0;
}

uint64_t scatter(const Parcel& p) {
  const uint8_t* at = p.begin;
  const auto width = take<uint32_t>(at), height = take<uint32_t>(at), count = take<uint32_t>(at);
  Mask mask(static_cast<int>(width), static_cast<int>(height));
  for (uint32_t i = 0; i < count; ++i) {
    const auto x = take<uint16_t>(at), y = take<uint16_t>(at);
    mask.set(x, y);
  }
  BitReader bits;
  bits.start({at, p.end}, size_t{count} * kParts * GolombContext::kMostBits);
  GolombContext context;
  context.start(100);
  ScatterWalk walk;
  ScatterPredictor predictor;
  predictor.start({});
  Digest digest;
  walk(mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    int parts[kParts];
    parts_of(predictor.predict(x, y, neighbours), parts);
    for (int& part : parts) digest.add(static_cast<uint32_t>(part += context.get(bits.source)));
    predictor.add(x, y, pixel_of(parts), {});
    return true;
  });
  return bits.finished() ? digest.value() : 0;
}

uint64_t digest_of(const Result<image::DepthImage>& image) {
  if (!image.ok()) return 0;
  Digest digest;
  for (const int n : {image->width, image->height}) digest.add(static_cast<uint32_t>(n));
  for (size_t i = 0; i < image->pixels(); ++i)
    for (const uint32_t v : {image->depth[i], image->colour[i], uint32_t{image->normal[i]}}) digest.add(v);
  return digest.value();
}

uint64_t depth(const Parcel& p) { return digest_of(codec::decode({p.begin, p.end})); }

uint64_t refinement(const Parcel& p) {
  const uint8_t* at = p.begin;
  const auto bytes = take<uint32_t>(at);
  const auto bounded = codec::decode({at, bytes});
  return bounded.ok() ? digest_of(codec::decode_refinement({at + bytes, p.end}, *bounded)) : 0;
}

struct Row {
  Kind kind;
  const char* name;
  uint64_t (*decode)(const Parcel&);
};
constexpr Row kRows[] = {{Kind::kGolomb, "golomb", golomb},
                         {Kind::kScatter, "scatter", scatter},
                         {Kind::kDepth, "depth", depth},
                         {Kind::kRefinement, "refinement", refinement}};

// Prints a parcel's line; true if its digest is right.
bool tell(int number, const Parcel& p) {
  for (const Row& row : kRows) {
    if (row.kind != p.kind) continue;
    const uint64_t digest = row.decode(p);
    std::printf("%d %s %016llx %s\n", number, row.name, static_cast<unsigned long long>(digest),
                digest == p.digest ? "same" : "DIFFERENT");
    return digest == p.digest;
  }
  std::printf("%d unknown\n", number);
  return false;
}

std::vector<uint8_t> standard_input() {
  std::vector<uint8_t> out;
  uint8_t piece[1 << 16];
  for (size_t n; (n = std::fread(piece, 1, sizeof(piece), stdin)) > 0;) out.insert(out.end(), piece, piece + n);
  return out;
}

int run() {
  constexpr size_t kHead = 5, kTail = 8;
  const auto all = standard_input();
  int number = 0;
  bool good = !all.empty();
  for (const uint8_t *at = all.data(), *end = at + all.size(); at < end; ++number) {
    Parcel p{};
    if (static_cast<size_t>(end - at) < kHead + kTail) return 2;
    p.kind = take<Kind>(at);
    const auto bytes = take<uint32_t>(at);
    if (static_cast<size_t>(end - at) < bytes + kTail) return 2;
    p.begin = at, p.end = at += bytes;
    p.digest = take<uint64_t>(at);
    good &= tell(number, p);
  }
  return good ? 0 : 1;
}

}  // namespace
}  // namespace telesplat::portable

#if defined(__wasm__)
// WASI has no threads, and the C++ library leaves open what to do at their ends: nothing.
extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*) { return 0; }
#endif

int main() { return telesplat::portable::run(); }
