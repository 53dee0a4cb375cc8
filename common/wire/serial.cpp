#include "common/wire/serial.h"

#include <fmt/format.h>

#include <array>

#include "common/wire/checks.h"
#include "common/wire/decoder.h"
#include "common/wire/encoder.h"

namespace telesplat::wire {
namespace {

/// How one message is written and read.
struct Codec {
  std::string_view name;
  size_t body_limit, element_limit;
  void (*write)(Encoder&, const void*);
  std::optional<Error> (*read)(Decoder&, void*);
};

template <class M>
void write(Encoder& encoder, const void* message) {
  encoder.versioned_map(*static_cast<const M*>(message));
}

template <class M>
std::optional<Error> read(Decoder& decoder, void* message) {
  M& m = *static_cast<M*>(message);
  if (kIsBrief<M>) decoder.be_brief();
  M::fields(decoder, m);
  return decoder.error() ? decoder.error() : check(m);
}

template <class... M>
constexpr std::array<Codec, sizeof...(M)> codecs(std::type_identity<std::tuple<M...>>) {
  return {{{M::kName, kBodyLimit<M>, element_limit<M>(), write<M>, read<M>}...}};
}
constexpr auto kCodecs = codecs(std::type_identity<Messages>{});

std::string encode_as(uint64_t version, const auto& message) {
  std::string body;
  Encoder(body).versioned_map(message, version);
  return body;
}

}  // namespace

std::string detail::encode(size_t number, const void* message) {
  std::string body;
  Encoder encoder(body);
  kCodecs[number].write(encoder, message);
  return body;
}

std::optional<Error> detail::decode(size_t number, Bytes body, void* message) {
  const Codec& codec = kCodecs[number];
  const auto refused = [&](std::string_view why) { return Error{fmt::format("{}: {}", codec.name, why)}; };
  if (body.size() > codec.body_limit) return refused(fmt::format("{} bytes, limit {}", body.size(), codec.body_limit));
  const auto bad = read_map(body, codec.element_limit, [&](Decoder& decoder) { return codec.read(decoder, message); });
  return bad ? std::optional(refused(bad->text)) : std::nullopt;
}

std::optional<uint64_t> other_version(Bytes body) {
  const auto version = version_of(body);
  return version == kProtocolVersion ? std::nullopt : version;
}

std::string about_versions(uint64_t other) {
  return fmt::format("it speaks version {} of the protocol, and this master version {}", other, kProtocolVersion);
}

std::string encode_for(uint64_t version, const Shutdown& message) { return encode_as(version, message); }
std::string encode_for(uint64_t version, const ControlReply& message) { return encode_as(version, message); }

}  // namespace telesplat::wire
