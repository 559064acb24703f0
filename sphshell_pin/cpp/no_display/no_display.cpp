// Stands for libGL.so.1 and libX11.so.6 where a machine has none. OpenCASCADE's libraries name the
// functions below in tables that are filled when they are loaded; reading a file calls none of
// them.
extern "C" void sphshell_pin_no_display() { __builtin_trap(); }

#define S(name) extern "C" void name() __attribute__((alias("sphshell_pin_no_display")));
// clang-format off
S(XCheckWindowEvent) S(XCloseDisplay) S(XCreateColormap) S(XCreateWindow) S(XDestroyWindow)
S(XFlush) S(XFree) S(XGetVisualInfo) S(XGetWindowAttributes) S(XIconifyWindow) S(XInternAtom)
S(XLookupKeysym) S(XMapWindow) S(XOpenDisplay) S(XPending) S(XQueryExtension) S(XSendEvent)
S(XSetErrorHandler) S(XSetStandardProperties) S(XStoreName) S(XSynchronize)
S(XTranslateCoordinates) S(glAlphaFunc) S(glBindTexture) S(glBitmap) S(glBlendFunc)
S(glCallList) S(glCallLists) S(glClear) S(glClearColor) S(glClearDepth) S(glClearStencil)
S(glClipPlane) S(glColor4fv) S(glColorMask) S(glColorMaterial) S(glColorPointer)
S(glCopyPixels) S(glCopyTexImage1D) S(glCopyTexImage2D) S(glCopyTexSubImage1D)
S(glCopyTexSubImage2D) S(glCullFace) S(glDeleteLists) S(glDeleteTextures) S(glDepthFunc)
S(glDepthMask) S(glDepthRange) S(glDisable) S(glDisableClientState) S(glDrawArrays)
S(glDrawBuffer) S(glDrawElements) S(glDrawPixels) S(glEnable) S(glEnableClientState)
S(glEndList) S(glFinish) S(glFlush) S(glFrontFace) S(glGenLists) S(glGenTextures)
S(glGetBooleanv) S(glGetError) S(glGetFloatv) S(glGetIntegerv) S(glGetPointerv) S(glGetString)
S(glGetTexEnviv) S(glGetTexImage) S(glGetTexLevelParameterfv) S(glGetTexLevelParameteriv)
S(glGetTexParameterfv) S(glGetTexParameteriv) S(glHint) S(glIndexPointer) S(glIsEnabled)
S(glIsTexture) S(glLightModelfv) S(glLightModeli) S(glLightf) S(glLightfv) S(glLineStipple)
S(glLineWidth) S(glListBase) S(glLoadIdentity) S(glLoadMatrixf) S(glLogicOp) S(glMaterialf)
S(glMaterialfv) S(glMatrixMode) S(glNewList) S(glNormalPointer) S(glPixelStorei)
S(glPixelTransferi) S(glPointSize) S(glPolygonMode) S(glPolygonOffset) S(glPolygonStipple)
S(glRasterPos2i) S(glRasterPos3fv) S(glReadBuffer) S(glReadPixels) S(glScissor)
S(glShadeModel) S(glStencilFunc) S(glStencilMask) S(glStencilOp) S(glTexCoordPointer)
S(glTexEnvi) S(glTexGenfv) S(glTexGeni) S(glTexImage1D) S(glTexImage2D) S(glTexParameterf)
S(glTexParameterfv) S(glTexParameteri) S(glTexParameteriv) S(glTexSubImage1D)
S(glTexSubImage2D) S(glVertexPointer) S(glViewport) S(glXChooseFBConfig) S(glXChooseVisual)
S(glXCreateContext) S(glXDestroyContext) S(glXGetClientString) S(glXGetConfig)
S(glXGetCurrentContext) S(glXGetCurrentDisplay) S(glXGetCurrentDrawable) S(glXGetProcAddress)
S(glXGetVisualFromFBConfig) S(glXIsDirect) S(glXMakeCurrent) S(glXQueryExtension)
S(glXQueryExtensionsString) S(glXQueryServerString) S(glXQueryVersion) S(glXSwapBuffers)
S(glXWaitGL)
    // clang-format on
