// Housing of the GRC: torque arm, ring and rear housing in one piece, mm, for gmsh. gearbox.toml takes housing.step, which
// write_step.py makes of it.
//
// Letters as in gearbox.toml: P1, P2 printed, D derived, A assumed. Followed from printed numbers: bores of the bearings
// and their places, flange, root and face of the ring, places of the axes. Invented (A), because no dimensioned drawings
// are published: walls, webs, bosses, rib and torque arm; they bring the mass near the printed one.
SetFactory("OpenCASCADE");
Geometry.OCCUnionUnify = 0;  // edges between fused pieces stay: seats end on them

wall = 28;                // A
ring_low = -219.5;        // D   seat plane 10.5 less the face
ring_high = 10.5;         // P2
ring_outer = 595;         // D
ring_root = 523.5;        // P1
front = -338;             // A   upwind end of PLC-A's seat
front_wall = 35;          // A   of the tube around the carrier
parallel_x = 130;         // A   middle of the chamber about both parallel shafts
parallel_y = 400;         // A
chamber_main = 560;       // A   outer radii about the main axis and about that middle
chamber_parallel = 360;   // A
chamber_end = 640;        // A
arm = 900;                // A   half of the trunnions' spacing
trunnion = 40;            // A   radius
ims_x = 246.302;          // P2
ims_y = 376.611;          // P2
hss_y = 520;              // P2

// Ring in the sectors of its seat, so that their edges are edges of the mesh; the first is centred at +x.
sectors = 9;
pieces() = {};
For n In {0:sectors - 1}
  piece = newv; Cylinder(piece) = {0, 0, ring_low, 0, 0, ring_high - ring_low, ring_outer, 2 * Pi / sectors};
  Rotate{ {0, 0, 1}, {0, 0, 0}, (n - 0.5) * 2 * Pi / sectors } { Volume{piece}; }
  pieces() += {piece};
EndFor
bore = newv; Cylinder(bore) = {0, 0, ring_low - 10, 0, 0, ring_high - ring_low + 20, ring_root};
body() = BooleanDifference{ Volume{pieces()}; Delete; }{ Volume{bore}; Delete; };
more() = {};

// Front: a tube around the carrier, a plate that carries PLC-A, and the torque arm.
tube = newv; Cylinder(tube) = {0, 0, front, 0, 0, ring_low - front, ring_outer};
bore = newv; Cylinder(bore) = {0, 0, front - 10, 0, 0, ring_low - front + 20, ring_outer - front_wall};
more() += BooleanDifference{ Volume{tube}; Delete; }{ Volume{bore}; Delete; };
plate = newv; Cylinder(plate) = {0, 0, front, 0, 0, wall, ring_outer}; more() += {plate};
right = newv; Box(right) = {ring_outer - 30, -90, front, arm + 60 - (ring_outer - 30), 180, 100}; more() += {right};
left = newv; Box(left) = {-(arm + 60), -90, front, arm + 60 - (ring_outer - 30), 180, 100}; more() += {left};

// Rear: a chamber about the main axis and the parallel shafts, its wall and both its plates.
outside = newv; Cylinder(outside) = {0, 0, 0, 0, 0, chamber_end, chamber_main};
part = newv; Cylinder(part) = {parallel_x, parallel_y, 0, 0, 0, chamber_end, chamber_parallel};
shell() = BooleanUnion{ Volume{outside}; Delete; }{ Volume{part}; Delete; };
inside = newv; Cylinder(inside) = {0, 0, 120, 0, 0, 480, chamber_main - wall};
part = newv; Cylinder(part) = {parallel_x, parallel_y, 120, 0, 0, 480, chamber_parallel - wall};
room() = BooleanUnion{ Volume{inside}; Delete; }{ Volume{part}; Delete; };
carrier_room = newv; Cylinder(carrier_room) = {0, 0, -10, 0, 0, 95, 500};
more() += BooleanDifference{ Volume{shell()}; Delete; }{ Volume{room(), carrier_room}; Delete; };
flange = newv; Cylinder(flange) = {0, 0, ring_high, 0, 0, 39.5, ring_outer};
bore = newv; Cylinder(bore) = {0, 0, ring_high - 10, 0, 0, 59.5, 500};
more() += BooleanDifference{ Volume{flange}; Delete; }{ Volume{bore}; Delete; };

// Bosses (radii A) and bores of the bearings: x, y, from, to, bore, boss; all bores P2 but PLC-A (D).
holes() = {};
Macro Seat
  boss = newv; Cylinder(boss) = {x, y, from, 0, 0, to - from, boss_radius}; more() += {boss};
  hole = newv; Cylinder(hole) = {x, y, from, 0, 0, to - from, bore_radius}; holes() += {hole};
  hole = newv; Cylinder(hole) = {x, y, from - 60, 0, 0, to - from + 120, 0.8 * bore_radius}; holes() += {hole};
Return
x = 0; y = 0; from = front; to = -282; bore_radius = 290; boss_radius = 345; Call Seat;                 // PLC-A
x = 0; y = 0; from = 70.5; to = 124.8; bore_radius = 270.5; boss_radius = 310; Call Seat;               // PLC-B, LSS-A
x = 0; y = 0; from = 555; to = 659; bore_radius = 180; boss_radius = 225; Call Seat;                    // LSS-B/C
x = ims_x; y = ims_y; from = 114; to = 170; bore_radius = 90; boss_radius = 120; Call Seat;             // IMS-A
x = ims_x; y = ims_y; from = 555; to = 670; bore_radius = 136; boss_radius = 165; Call Seat;            // IMS-B/C
x = 0; y = hss_y; from = 114; to = 170; bore_radius = 90; boss_radius = 120; Call Seat;                 // HSS-A
x = 0; y = hss_y; from = 471; to = 680; bore_radius = 105.5; boss_radius = 135; Call Seat;              // HSS-B/C, rear bore
x = 0; y = hss_y; from = 426; to = 471; bore_radius = 100; boss_radius = 135; Call Seat;                // HSS-B/C, seat
rib = newv; Box(rib) = {-20, hss_y + 110, 426, 40, 90, 180}; more() += {rib};  // A   from that boss to the wall

body() = BooleanUnion{ Volume{body()}; Delete; }{ Volume{more()}; Delete; };
For side In {-1:1:2}
  hole = newv; Cylinder(hole) = {side * arm, 0, front, 0, 0, 100, trunnion}; holes() += {hole};
EndFor
body() = BooleanDifference{ Volume{body()}; Delete; }{ Volume{holes()}; Delete; };
