// UNTESTED: no Modelica tool was at hand.
//
// Modelica has no import of FMUs of its own: import CoreXY.fmu with the tool first (OpenModelica:
// File > Import > FMU; Dymola: File > Open > Import FMU), which makes a block with the inputs phi1,
// phi2, phi1_rate, phi2_rate and the outputs x, y, ...; put its name at FMU below.
model CoreXYBench "The stage behind real signals: a square at constant speed"
  parameter Real r(unit = "m") = 5e-3 "pulley radius, as pulley.radius of the FMU";
  parameter Real speed(unit = "m/s") = 0.1;
  parameter Real side(unit = "m") = 0.03;
  final parameter Real T(unit = "s") = side/speed "time of a side";
  replaceable block FMU = CoreXY_FMU "the imported FMU";
  FMU stage;
  Modelica.Blocks.Sources.CombiTimeTable path(
    table = [0, 0, 0; T, side, 0; 2*T, side, side; 3*T, 0, side; 4*T, 0, 0],
    smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments,
    extrapolation = Modelica.Blocks.Types.Extrapolation.HoldLastPoint) "x, y of the command";
  Real u(unit = "m/s") = if time < T then speed elseif time >= 2*T and time < 3*T then -speed else 0;
  Real w(unit = "m/s") =
    if time >= T and time < 2*T then speed elseif time >= 3*T and time < 4*T then -speed else 0;
equation
  stage.phi1 = (path.y[1] + path.y[2])/r;
  stage.phi2 = (path.y[1] - path.y[2])/r;
  stage.phi1_rate = (u + w)/r;
  stage.phi2_rate = (u - w)/r;
  annotation(experiment(StopTime = 1.3, Interval = 1e-3));
end CoreXYBench;
