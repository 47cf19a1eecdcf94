import { useRef, useState } from "react";

/**
 * Return the ref of a button in the header, and the props of its menu. The menu opens below the header, which shows
 * the states of the emergency stop and of the motors.
 */
export function useBelowHeader() {
  const target = useRef<HTMLButtonElement>(null);
  const [offset, setOffset] = useState(0);
  const onOpen = () => {
    const header = target.current?.closest("header");
    if (target.current && header)
      setOffset(header.getBoundingClientRect().bottom - target.current.getBoundingClientRect().bottom);
  };
  return { target, menu: { offset, onOpen } };
}
