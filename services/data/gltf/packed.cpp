#include "services/data/gltf/packed.h"

#include <meshoptimizer.h>

#include <draco/compression/decode.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "services/data/gltf/document.h"

namespace telesplat::data::gltf {
namespace {

// Runs of 256 equal elements are smallest: each four bytes become two bits.
constexpr size_t kMostExpansion = 1024;
constexpr size_t kGroup = 16;

// Version 1 of the attribute codec: meshoptimizer reads it from 0.23 on, and Debian 12 has 0.18.
class AttributeDecoder {
 public:
  AttributeDecoder(std::span<const uint8_t> packed, size_t stride) : stride_(stride) {
    const size_t tail = stride + stride / 4, padded = std::max<size_t>(tail, 24);
    if (packed.size() < 1 + padded) refuse("{} bytes are too few", packed.size());
    rest_ = packed.subspan(1, packed.size() - 1 - padded);
    const auto end = packed.last(tail);
    last_.assign(end.begin(), end.begin() + std::ptrdiff_t(stride));
    channels_.assign(end.begin() + std::ptrdiff_t(stride), end.end());
  }

  void decode(size_t count, uint8_t* out) {
    const size_t most = std::min<size_t>(8192 / stride_ / kGroup * kGroup, 256);
    std::vector<uint8_t> deltas(most * stride_);
    for (size_t n = 0; count > 0; count -= n) {
      n = std::min(count, most);
      const uint8_t* control = take(stride_ / 4);
      for (size_t byte = 0; byte < stride_; ++byte)
        unpack(control[byte / 4] >> byte % 4 * 2 & 3, n, &deltas[byte * most]);
      for (size_t e = 0; e < n; ++e, out += stride_) {
        for (size_t k = 0; k < stride_; k += 4) {
          const uint8_t* d = &deltas[k * most + e];
          add(channels_[k / 4], {d[0], d[most], d[2 * most], d[3 * most]}, &last_[k]);
        }
        std::copy(last_.begin(), last_.end(), out);
      }
    }
    if (!rest_.empty()) refuse("{} bytes are left", rest_.size());
  }

 private:
  const uint8_t* take(size_t bytes) {
    if (bytes > rest_.size()) refuse("it ends too early");
    const uint8_t* at = rest_.data();
    rest_ = rest_.subspan(bytes);
    return at;
  }

  // Unpacks one byte of each of n elements, in groups of 16 that take 0, 1, 2, 4 or 8 bits per value.
  void unpack(int control, size_t n, uint8_t* out) {
    constexpr int kBits[2][4] = {{0, 1, 2, 4}, {1, 2, 4, 8}};
    if (control == 2) std::fill_n(out, n, uint8_t{0});
    if (control == 3) std::copy_n(take(n), n, out);
    if (control >= 2) return;
    const size_t groups = (n + kGroup - 1) / kGroup;
    const uint8_t* header = take((groups + 3) / 4);
    for (size_t g = 0; g < groups; ++g) unpack_group(kBits[control][header[g / 4] >> g % 4 * 2 & 3], out + g * kGroup);
  }

  // Unpacks values of `bits` bits; the largest value says that the real one follows as a byte.
  void unpack_group(int bits, uint8_t* out) {
    std::fill_n(out, kGroup, uint8_t{0});
    const uint8_t* packed = take(size_t(2 * bits));
    const unsigned largest = (1u << bits) - 1;
    for (int i = 0; bits && i < int(kGroup); ++i) {
      const int at = i * bits, shift = bits == 1 ? i % 8 : 8 - bits - at % 8;
      const unsigned value = packed[at / 8] >> shift & largest;
      out[i] = bits < 8 && value == largest ? *take(1) : uint8_t(value);
    }
  }

  // Adds an element's four-byte deltas to the element before: differences of bytes or of pairs, or rotated bits.
  static void add(uint8_t channel, std::array<uint8_t, 4> delta, uint8_t* to) {
    const auto unzigzag = [](unsigned v) { return v >> 1 ^ (0 - (v & 1)); };
    const auto pair = [](const uint8_t* p) { return unsigned(p[0] | p[1] << 8); };
    if ((channel & 3) == 0) {
      for (int i = 0; i < 4; ++i) to[i] = uint8_t(to[i] + unzigzag(delta[size_t(i)]));
    } else if ((channel & 3) == 1) {
      for (int i = 0; i < 4; i += 2) {
        const unsigned sum = pair(to + i) + unzigzag(pair(&delta[size_t(i)]));
        to[i] = uint8_t(sum), to[i + 1] = uint8_t(sum >> 8);
      }
    } else if ((channel & 3) == 2) {
      const uint32_t turned = std::rotr(std::bit_cast<uint32_t>(delta), channel >> 4);
      for (int i = 0; i < 4; ++i) to[i] ^= uint8_t(turned >> 8 * i);
    } else {
      refuse("channel mode {} is not one of 0..2", channel & 3);
    }
  }

  const size_t stride_;
  std::span<const uint8_t> rest_;
  std::vector<uint8_t> last_, channels_;
};

// Decodes colours from luma and two chromas of fewer bits; the highest bit of alpha gives their number of bits.
template <class Unsigned>
void decode_colours(std::span<std::byte> data) {
  using Signed = std::make_signed_t<Unsigned>;
  for (size_t at = 0; at + 4 * sizeof(Unsigned) <= data.size(); at += 4 * sizeof(Unsigned)) {
    std::array<Unsigned, 4> c;
    std::memcpy(c.data(), &data[at], sizeof c);
    const int y = c[0], co = Signed(c[1]), cg = Signed(c[2]), bits = std::bit_width(c[3]);
    const int most = (1 << bits) - 1, alpha = c[3] & most >> 1;
    const double scale = most ? double(std::numeric_limits<Unsigned>::max()) / most : 0;
    const auto whole = [&](int v) { return Unsigned(std::lround(std::clamp(v, 0, most) * scale)); };
    c = {whole(y + co - cg), whole(y + cg), whole(y - co - cg), whole(alpha << 1 | (alpha & 1))};
    std::memcpy(&data[at], c.data(), sizeof c);
  }
}

void apply_filter(const MeshoptView& view, std::span<std::byte> data) {
  const bool four_parts = view.stride == 4 || view.stride == 8;
  if (view.filter == "OCTAHEDRAL" && four_parts)
    meshopt_decodeFilterOct(data.data(), view.count, view.stride);
  else if (view.filter == "QUATERNION" && view.stride == 8)
    meshopt_decodeFilterQuat(data.data(), view.count, view.stride);
  else if (view.filter == "EXPONENTIAL")
    meshopt_decodeFilterExp(data.data(), view.count, view.stride);
  else if (view.filter == "COLOR" && four_parts)
    view.stride == 4 ? decode_colours<uint8_t>(data) : decode_colours<uint16_t>(data);
  else if (!view.filter.empty() && view.filter != "NONE")
    refuse("filter {} does not go with a stride of {} bytes", view.filter, view.stride);
}

}  // namespace

std::vector<std::byte> decode_meshopt(std::span<const std::byte> packed, const MeshoptView& view) {
  const bool attributes = view.mode == "ATTRIBUTES";
  const bool fits =
      attributes ? view.stride > 0 && view.stride <= 256 && view.stride % 4 == 0 : view.stride == 2 || view.stride == 4;
  if (!fits) refuse("mode {} does not go with a stride of {} bytes", view.mode, view.stride);
  if (packed.empty() || view.count > packed.size() * kMostExpansion / view.stride)
    refuse("{} elements of {} bytes are more than {} bytes can hold", view.count, view.stride, packed.size());
  const auto* bytes = reinterpret_cast<const unsigned char*>(packed.data());
  std::vector<std::byte> out(view.count * view.stride);
  int failed = 0;
  if (attributes && bytes[0] == 0xa1)
    AttributeDecoder({bytes, packed.size()}, view.stride).decode(view.count, reinterpret_cast<uint8_t*>(out.data()));
  else if (attributes)
    failed = meshopt_decodeVertexBuffer(out.data(), view.count, view.stride, bytes, packed.size());
  else if (view.mode == "TRIANGLES" && view.count % 3 == 0)
    failed = meshopt_decodeIndexBuffer(out.data(), view.count, view.stride, bytes, packed.size());
  else if (view.mode == "INDICES")
    failed = meshopt_decodeIndexSequence(out.data(), view.count, view.stride, bytes, packed.size());
  else
    refuse("mode {} with {} elements", view.mode, view.count);
  if (failed) refuse("mode {}, error {}", view.mode, failed);
  if (attributes) apply_filter(view, out);
  return out;
}

DracoMesh decode_draco(Bytes packed, const std::vector<uint32_t>& ids) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(packed.data()), packed.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) refuse("{}", decoded.status().error_msg());
  draco::Mesh& mesh = *decoded.value();
  DracoMesh out;
  out.indices.reserve(size_t{3} * mesh.num_faces());
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
    for (int k = 0; k < 3; ++k) out.indices.push_back(mesh.face(f)[size_t(k)].value());
  for (const uint32_t id : ids) {
    const int32_t number = mesh.GetAttributeIdByUniqueId(id);
    if (number < 0) refuse("there is no attribute {}", id);
    draco::PointAttribute* attribute = mesh.attribute(number);
    const int width = attribute->num_components();
    if (width < 1 || width > 4) refuse("attribute {} has {} components", id, width);
    attribute->set_normalized(false);
    Values& values = out.attributes[id];
    values.width = width;
    values.numbers = std::make_shared<std::vector<float>>(size_t(mesh.num_points()) * size_t(width));
    for (uint32_t p = 0; p < mesh.num_points(); ++p) {
      const auto at = attribute->mapped_index(draco::PointIndex(p));
      if (at.value() >= attribute->size() ||
          !attribute->ConvertValue<float>(at, int8_t(width), values.numbers->data() + size_t(p) * size_t(width)))
        refuse("attribute {} lacks a value for point {}", id, p);
    }
  }
  return out;
}

}  // namespace telesplat::data::gltf
