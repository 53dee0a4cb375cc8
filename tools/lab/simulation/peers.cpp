#include "tools/lab/simulation/peers.h"

#include <iterator>
#include <utility>

namespace telesplat::simulation {
namespace {

ProcessOptions attached(bool keys, const Event& e) {
  ProcessOptions out;
  if (keys)
    out.key = Identity{is_order(e.fault) ? "operator" : "stranger",
                       is_order(e.fault) ? net::Role::kOperator : net::Role::kViewer};
  return out;
}

wire::Control order_of(const Event& e) {
  const int n = int(e.amount);
  switch (e.fault) {
    case Fault::kClip:
      return {"clip", {{"clip", n == 0 ? "off" : n == 1 ? "plane x>=40%" : "plane y<=60%"}}};
    case Fault::kCoupling:
      if (n < 2) return {"coupling", {{"coupling", n == 0 ? "async" : "sync"}}};
      return {"coupling", {{"coupling", "loose"}, {"buffers", std::to_string(n)}}};
    case Fault::kStatus:
      return {"status", {}};
    default:
      return {"epoch", {}};
  }
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
  if (hello && hello->role == "packer") packer_state = hello->endpoints.at("state");
}

Session::Peer::Peer(SimulatedNetwork& network, int process, bool keys, const Event& e)
    : context_(network.attach(process, attached(keys, e))), socket_(context_, net::Kind::kDealer, "peer") {}

void Session::Peer::speak(const Event& e, const std::string& name, const Heard& heard, Dice& dice) {
  const bool to_packer = e.fault == Fault::kStranger && e.a.role == Role::kPacker;
  if (to_packer && heard.packer_state.empty()) return;
  if (!socket_.connect(to_packer ? heard.packer_state : kMasterEndpoint)) return;
  if (e.fault == Fault::kImpostor) {
    wire::Hello hello;
    hello.role = kRoleNames[size_t(e.b.role)];
    hello.name = name;
    hello.instance = {dice.bits() >> 11 | 1};
    hello.pid = 1;
    socket_.send(hello);
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
