#include "tools/lab/simulation/peers.h"

#include <iterator>
#include <utility>

namespace telesplat::simulation {
namespace {

ProcessOptions attached(bool keys, const Event& e) {
  if (!keys) return {};
  const bool orders = e.fault == Fault::kOrder, data = e.fault == Fault::kImpostor && e.b.role == Role::kData;
  return {.key = Identity{orders ? "operator" : "stranger", orders ? net::Role::kOperator
                                                            : data ? net::Role::kData
                                                                   : net::Role::kViewer}};
}

// The hello that was heard last, or a new one under the name; a data server's volume lacks all that makes one.
std::string hello_of(const Event& e, const std::string& name, const Heard& heard, Dice& dice) {
  const auto said = heard.hellos.find(std::string(kRoleNames[size_t(e.b.role)]));
  if (e.amount == 1 && e.b.role != Role::kData && said != heard.hellos.end()) return said->second;
  wire::Hello hello;
  hello.role = kRoleNames[size_t(e.b.role)];
  hello.name = e.b.role == Role::kData ? "data-9" : name;
  if (e.b.role == Role::kData) hello.facts["kind"] = "volume";
  hello.instance = {dice.bits() >> 11 | 1};
  hello.pid = 1;
  return wire::encode(hello);
}

}  // namespace

void Heard::listen(const Passed& m) {
  if (m.what != Passed::What::kSent || m.kind != net::Kind::kDealer || m.body.empty()) return;
  const std::string body(reinterpret_cast<const char*>(m.body.data()), m.body.size());
  const bool state =
      m.type == wire::StateRequest::kName || m.type == wire::AccessReport::kName || m.type == wire::Receipt::kName;
  (state ? to_packer : to_master)[std::string(m.type)] = body;
  if (m.type != wire::Hello::kName) return;
  const auto hello = wire::decode<wire::Hello>(m.body);
  if (!hello) return;
  hellos[hello->role] = body;
  if (hello->role == "packer" && hello->endpoints.contains("state")) packer_state = hello->endpoints.at("state");
}

Session::Peer::Peer(SimulatedNetwork& network, int process, bool keys, const Event& e)
    : context_(network.attach(process, attached(keys, e))), socket_(context_, net::Kind::kDealer, "peer") {}

void Session::Peer::speak(const Event& e, const std::string& name, const Heard& heard, Dice& dice) {
  const bool to_packer = e.fault == Fault::kStranger && e.a.role == Role::kPacker;
  if (to_packer && heard.packer_state.empty()) return;
  if (!socket_.connect(to_packer ? heard.packer_state : kMasterEndpoint)) return;
  if (e.fault == Fault::kImpostor) {
    socket_.send_frames({}, std::string(wire::Hello::kName), hello_of(e, name, heard, dice));
  } else if (e.fault == Fault::kStranger) {
    const auto& words = to_packer ? heard.to_packer : heard.to_master;
    for (int n = 0; n < int(e.amount) && !words.empty(); ++n) {
      const auto& [type, body] = *std::next(words.begin(), long(dice.below(words.size())));
      socket_.send_frames({}, type, body);
    }
  } else {
    socket_.send(order_of(e));
  }
}

}  // namespace telesplat::simulation
