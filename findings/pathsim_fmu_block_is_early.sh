#!/usr/bin/env bash
# pathsim-fmi 0.1.1 with pathsim 0.27.1 and FMPy 0.3.32 (PyPI), 2026-11-30: the co-simulation block shows outputs one step early, and
# replaces start values of inputs by zero.
#
# A unit of FMI 2.0 has the outputs y, the time that it has reached, and w, its input u, whose start value is 5. Steps of 0.1 s. Seen: at
# 0 s the block shows y = 0.1, and so on; w is 0 from the first step on, although u is not connected. Needs a C compiler.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pathsim-fmi==0.1.1 pathsim==0.27.1 FMPy==0.3.32
cd "$folder"
mkdir -p unit/binaries/linux64
cat > clock.c <<'C'
#include <stddef.h>
typedef int Status;
static double reached, u = 5.0;
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *n, int t, const char *g, const char *r, const void *f, int v, int l) { return &reached; }
void fmi2FreeInstance(void *c) {}
Status fmi2GetReal(void *c, const unsigned *r, size_t n, double *v) {
    for (size_t k = 0; k < n; k++) v[k] = r[k] == 0 ? reached : u;
    return 0;
}
Status fmi2SetReal(void *c, const unsigned *r, size_t n, const double *v) {
    for (size_t k = 0; k < n; k++) if (r[k] == 2) u = v[k];
    return 0;
}
Status fmi2DoStep(void *c, double time, double step, int p) { reached = time + step; return 0; }
#define OTHER(name) Status fmi2##name(void) { return 0; }
OTHER(SetDebugLogging) OTHER(SetupExperiment) OTHER(EnterInitializationMode) OTHER(ExitInitializationMode) OTHER(Terminate)
OTHER(Reset) OTHER(GetInteger) OTHER(GetBoolean) OTHER(GetString) OTHER(SetInteger) OTHER(SetBoolean) OTHER(SetString)
OTHER(GetFMUstate) OTHER(SetFMUstate) OTHER(FreeFMUstate) OTHER(SerializedFMUstateSize) OTHER(SerializeFMUstate)
OTHER(DeSerializeFMUstate) OTHER(GetDirectionalDerivative) OTHER(SetRealInputDerivatives) OTHER(GetRealOutputDerivatives)
OTHER(CancelStep) OTHER(GetStatus) OTHER(GetRealStatus) OTHER(GetIntegerStatus) OTHER(GetBooleanStatus) OTHER(GetStringStatus)
C
cc -w -shared -fPIC -o unit/binaries/linux64/clock.so clock.c
cat > unit/modelDescription.xml <<'XML'
<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="clock" guid="{1}"><CoSimulation modelIdentifier="clock"/><ModelVariables>
<ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="w" valueReference="1" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="u" valueReference="2" causality="input"><Real start="5"/></ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="1"/><Unknown index="2"/></Outputs></ModelStructure></fmiModelDescription>
XML
(cd unit && python3 -m zipfile -c ../clock.fmu modelDescription.xml binaries)
cat > run.py <<'PY'
from pathsim import Connection, Simulation
from pathsim.blocks import Scope
from pathsim_fmi import CoSimulationFMU

block, scope = CoSimulationFMU("clock.fmu", dt=0.1), Scope()
Simulation([block, scope], [Connection(block[0], scope[0]), Connection(block[1], scope[1])], dt=0.1, log=False).run(0.35)
times, (reached, inputs) = scope.read()
for row in zip(times, reached, inputs):
    print("time {:.1f} s: y = {:.1f}, w = {:.1f}".format(*row))
assert abs(reached[1] - times[1] - 0.1) < 1e-9, "outputs belong to their times now"
assert inputs[1] == 0.0, "an input that is not connected keeps its start value now"
PY
venv/bin/python run.py
