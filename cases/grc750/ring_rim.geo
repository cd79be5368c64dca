// Rim of the GRC's ring gear below its teeth, without bolt holes, mm, for gmsh. Part of housing.geo; here by itself.
// Letters as in gearbox.toml: P1, P2 printed, D derived, A assumed.
SetFactory("OpenCASCADE");

low = -219.5;             // D   seat plane 10.5 less the face
face = 230;               // P1
outer = 595;              // D
root = 523.5;             // P1

rim = newv; Cylinder(rim) = {0, 0, low, 0, 0, face, outer};
bore = newv; Cylinder(bore) = {0, 0, low - 10, 0, 0, face + 20, root};
BooleanDifference{ Volume{rim}; Delete; }{ Volume{bore}; Delete; }
