// Depth of facets with vectors: in which of eight planes through known pixels a pixel lies. Included once for every
// instruction set, in its namespace. No include guard: that is meant.

// As PlaneResiduals().
static void PlaneResidualsVector(const uint32_t* HWY_RESTRICT above2, const uint32_t* HWY_RESTRICT above,
                                 const uint32_t* HWY_RESTRICT row, size_t n, uint32_t* HWY_RESTRICT z,
                                 uint8_t* HWY_RESTRICT tokens) {
  const hn::RebindToSigned<D> s;
  const hn::Rebind<float, D> floats;
  const auto most = hn::Set(kD, 0xFFFFFFu);
  for (size_t x = 0; x < n; x += kN) {
    const auto at = [&](const uint32_t* from, ptrdiff_t by) HWY_ATTR { return hn::LoadU(kD, from + x + by); };
    const V up = at(above, 0), corner = at(above, -1), right = at(above, 1), left = at(row, -1);
    const V v = hn::Add(at(row, 0), hn::Set(kD, 2u)), past_left = hn::Sub(v, left), past_up = hn::Sub(v, up);
    const V linear = hn::Add(hn::Sub(past_left, up), corner);
    const V high = hn::ShiftLeft<8>(hn::Sub(linear, hn::Set(kD, 2u)));
    const V sign = hn::BitCast(kD, hn::ShiftRight<31>(hn::BitCast(s, high)));
    const V folded = hn::ShiftRight<8>(hn::Xor(hn::Add(high, high), sign));
    hn::StoreU(folded, kD, z + x);
    const V number = hn::BitCast(kD, hn::ConvertTo(floats, hn::BitCast(s, hn::Add(folded, hn::Set(kD, 8u)))));
    V token = hn::Sub(hn::ShiftRight<20>(number), hn::Set(kD, 1040u - kHits));
    const auto hit = [&](uint32_t k, V off) HWY_ATTR {
      const V near = hn::And(off, most);
      token = hn::IfThenElse(Exceeds(hn::Set(kD, 5u), near), hn::Add(near, hn::Set(kD, 5 * k)), token);
    };
    hit(7, hn::Add(hn::Sub(v, hn::Add(right, right)), at(above2, 2)));
    hit(6, hn::Add(hn::Sub(past_up, corner), at(above2, -1)));
    hit(5, hn::Add(hn::Sub(past_up, right), at(above2, 1)));
    hit(4, hn::Add(hn::Sub(past_left, corner), at(above, -2)));
    hit(3, hn::Add(hn::Sub(past_up, up), at(above2, 0)));
    hit(2, hn::Add(hn::Sub(past_left, right), up));
    hit(1, hn::Add(hn::Sub(past_left, left), at(row, -2)));
    hit(0, linear);
    hn::StoreU(LowBytes(token), kD8, tokens + x);
  }
}

// As PlaneTerms().
static void PlaneTermsVector(const uint32_t* HWY_RESTRICT above2, const uint32_t* HWY_RESTRICT above,
                             const uint32_t* HWY_RESTRICT z, const uint8_t* HWY_RESTRICT tokens,
                             const uint8_t* HWY_RESTRICT cover, size_t n, uint32_t* HWY_RESTRICT terms,
                             uint32_t* HWY_RESTRICT take_left, uint32_t* HWY_RESTRICT take_slope) {
  const V one = hn::Set(kD, 1u), all = hn::Set(kD, ~0u), none = hn::Zero(kD);
  const hn::RebindToSigned<D> s;
  const hn::Rebind<int8_t, D> signed_bytes;
  for (size_t x = 0; x < n; x += kN) {
    const auto at = [&](const uint32_t* from, ptrdiff_t by) HWY_ATTR { return hn::LoadU(kD, from + x + by); };
    const V up = at(above, 0), corner = at(above, -1), right = at(above, 1);
    const V token = Load8(tokens + x), k = hn::ShiftRight<8>(hn::Mul(token, hn::Set(kD, 52u)));
    const auto is = [&](uint32_t plane) HWY_ATTR { return hn::Eq(k, hn::Set(kD, plane)); };
    const V next = hn::Sub(up, corner);
    V line = hn::IfThenElse(is(1), none, next);
    line = hn::IfThenElse(is(2), hn::Sub(right, up), line);
    line = hn::IfThenElse(is(3), hn::Sub(hn::Add(up, up), at(above2, 0)), line);
    line = hn::IfThenElse(is(4), hn::Sub(corner, at(above, -2)), line);
    line = hn::IfThenElse(is(5), hn::Sub(hn::Add(up, right), at(above2, 1)), line);
    line = hn::IfThenElse(is(6), hn::Sub(hn::Add(up, corner), at(above2, -1)), line);
    line = hn::IfThenElse(is(7), hn::Sub(hn::Add(right, right), at(above2, 2)), line);
    const V number = at(z, 0), missed = hn::Xor(hn::ShiftRight<1>(number), hn::Sub(none, hn::And(number, one)));
    const V five = hn::Add(hn::ShiftLeft<2>(k), k), off = hn::Sub(hn::Sub(token, five), hn::Set(kD, 2u));
    const M planes = Exceeds(hn::Set(kD, 8u), k);
    V term = hn::Add(line, hn::IfThenElse(planes, off, missed));
    // Planes 3 and 5 to 7 go through no pixel to the left, plane 1 through two.
    const M later = hn::And(Exceeds(k, hn::Set(kD, 4u)), planes);
    V left = hn::IfThenElse(hn::Or(is(3), later), none, all), slope = hn::IfThenElse(is(1), all, none);
    if (cover != nullptr) {
      const V covered =
          hn::BitCast(kD, hn::PromoteTo(s, hn::LoadU(signed_bytes, reinterpret_cast<const int8_t*>(cover) + x)));
      term = hn::Xor(next, hn::And(hn::Xor(term, next), covered));
      left = hn::Or(left, hn::Xor(covered, all)), slope = hn::And(slope, covered);
    }
    hn::StoreU(term, kD, terms + x), hn::StoreU(left, kD, take_left + x), hn::StoreU(slope, kD, take_slope + x);
  }
}
