// Planet carrier of the GRC with its pins, mm, for gmsh. gearbox.toml takes carrier.step, which write_step.py makes of it.
//
// Letters as in gearbox.toml: P1, P2 printed, D derived, A assumed. Followed from printed numbers: bores, widths and
// places of the bearings, orbit of the planets. Invented (A), because no dimensioned drawings are published: plates and
// webs; they bring the mass near the printed one.
SetFactory("OpenCASCADE");
Geometry.OCCUnionUnify = 0;  // edges between fused pieces stay: seats end on them

orbit = 308;              // P2
upwind_low = -281;        // A   plates, clear of the planets' faces (227.5, P1)
upwind_high = -229;       // A
downwind_low = 20;        // A
downwind_high = 62;       // A
plate = 430;              // A   radius, as the estimate of its inertia
planet_room = 222;        // D   tips 421.3 / 2 with clearance
web_depth = 260;          // A   webs no deeper than the planets' bores
pin = 80;                 // D   bore of NJ 2232
journal_a = 230;          // D   bore of PLC-A
journal_b = 200;          // D   bore of PLC-B
bore_shaft = 180;         // A   main shaft of 360
bore_sun = 175;           // D   outer ring of LSS-A 350

plates = newv; Cylinder(plates) = {0, 0, upwind_low, 0, 0, downwind_high - upwind_low, plate};
rooms() = {newv};
Cylinder(rooms(0)) = {0, 0, upwind_high, 0, 0, downwind_low - upwind_high, web_depth};
For planet In {0:2}
  angle = planet * 2 * Pi / 3;  // P1 equally spaced; first at +x A
  room = newv;
  Cylinder(room) = {orbit * Cos(angle), orbit * Sin(angle), upwind_high, 0, 0, downwind_low - upwind_high, planet_room};
  rooms() += {room};
EndFor
body() = BooleanDifference{ Volume{plates}; Delete; }{ Volume{rooms()}; Delete; };

// Journals and pins are cut across where the seats of bearings begin and end.
pieces() = {};
ends() = {-450, -338, -282, upwind_low + 10};  // A end, A, A, as PLC-A
For n In {0:2}
  piece = newv; Cylinder(piece) = {0, 0, ends(n), 0, 0, ends(n + 1) - ends(n), journal_a}; pieces() += {piece};
EndFor
ends() = {downwind_high - 10, 74.5, 120.5};    // P2 PLC-B
For n In {0:1}
  piece = newv; Cylinder(piece) = {0, 0, ends(n), 0, 0, ends(n + 1) - ends(n), journal_b}; pieces() += {piece};
EndFor
ends() = {upwind_high, -194.5, -114.5, -94.5, -14.5, downwind_low};  // A rows 100 apart, D widths
For planet In {0:2}
  angle = planet * 2 * Pi / 3;
  For n In {0:4}
    piece = newv;
    Cylinder(piece) = {orbit * Cos(angle), orbit * Sin(angle), ends(n), 0, 0, ends(n + 1) - ends(n), pin};
    pieces() += {piece};
  EndFor
EndFor
body() = BooleanUnion{ Volume{body()}; Delete; }{ Volume{pieces()}; Delete; };

hole_a = newv; Cylinder(hole_a) = {0, 0, -460, 0, 0, upwind_high + 1 + 460, bore_shaft};
hole_b = newv; Cylinder(hole_b) = {0, 0, downwind_low - 1, 0, 0, 130 - downwind_low + 1, bore_sun};
body() = BooleanDifference{ Volume{body()}; Delete; }{ Volume{hole_a, hole_b}; Delete; };
