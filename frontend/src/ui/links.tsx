import { Anchor, type AnchorProps, Button, type ButtonProps } from "@mantine/core";
import { createLink } from "@tanstack/react-router";
import { type ComponentPropsWithoutRef, forwardRef } from "react";

type Native = Omit<ComponentPropsWithoutRef<"a">, keyof AnchorProps | keyof ButtonProps>;

/** A link to another page with a type-checked address. */
export const PageLink = createLink(
  forwardRef<HTMLAnchorElement, AnchorProps & Native>((props, ref) => <Anchor ref={ref} {...props} />),
);

/** A button that links to another page with a type-checked address. */
export const ButtonLink = createLink(
  forwardRef<HTMLAnchorElement, ButtonProps & Native>((props, ref) => (
    <Button component="a" ref={ref} {...props} />
  )),
);
