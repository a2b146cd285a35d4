component kins_probe "Calls the kinematics that are loaded, to test them.";
pin in float joint-#[6];
pin in float world-#[6] "guess of the forward kinematics, pose of the inverse";
pin out float found-#[6];
pin out float length-#[6];
pin out signed forward;
pin out signed inverse;
pin out unsigned calls;
function call fp;
option singleton yes;
license "MIT-0";
;;
#include <kinematics.h>

FUNCTION(call) {
    EmcPose pose = {{world(0), world(1), world(2)}, world(3), world(4), world(5), 0, 0, 0};
    double joints[6], back[6];
    int i;
    (void)period;
    for (i = 0; i < 6; i++) joints[i] = joint(i);
    inverse = kinematicsInverse(&pose, back, 0, 0);
    for (i = 0; i < 6; i++) length(i) = back[i];
    forward = kinematicsForward(joints, &pose, 0, 0);
    found(0) = pose.tran.x;
    found(1) = pose.tran.y;
    found(2) = pose.tran.z;
    found(3) = pose.a;
    found(4) = pose.b;
    found(5) = pose.c;
    calls++;
}
