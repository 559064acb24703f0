"""Forward dynamics and kinematics of one model as compiled C, which CasADi generates."""
